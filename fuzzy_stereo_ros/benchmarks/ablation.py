# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Ablation: the matcher as it is, and with each part removed or replaced, on scenes and sequences.

Fitness is that of the matcher as it is: all chromosomes of a scene are measured alike.
"""
from dataclasses import dataclass
from functools import partial

from fuzzy_stereo_ros.benchmarks import ablation_picture, ablation_tables
from fuzzy_stereo_ros.benchmarks.correlation import Point
from fuzzy_stereo_ros.benchmarks.datasets import Scene
from fuzzy_stereo_ros.benchmarks.picture import as_svg
from fuzzy_stereo_ros.benchmarks.sequences import Sequence
from fuzzy_stereo_ros.benchmarks.truth import genes_of, truth_beside_result
from fuzzy_stereo_ros.benchmarks.variants import DEFAULT, REALTIME, Trial
from fuzzy_stereo_ros.evaluation.baselines import dense, opencv_threads, tuned_rivals
from fuzzy_stereo_ros.evaluation.ground_truth import bad_percent
from fuzzy_stereo_ros.evaluation.report import environment, Report
from fuzzy_stereo_ros.evaluation.scores import flicker
from fuzzy_stereo_ros.matching import StereoMatcher
import numpy as np

TURNS = 3       # of which the fastest counts
RIVAL = '3WAY'


@dataclass(frozen=True)
class StillResult:
    """
    What was found on a scene.

    trials: {name of variant or rival: `Trial`}. points: of all different chromosomes that came
    up; truth: the two figures of `truth_beside_result`.
    """

    scene: Scene
    trials: dict
    points: list
    truth: tuple


@dataclass(frozen=True)
class MovingResult:
    """
    What was found on a sequence.

    trials: {name of variant: `Trial`}, means of the scored frames, the time a median.
    flickers: {name of variant: percent}.
    """

    sequence: Sequence
    trials: dict
    flickers: dict


def run(request):
    """Return the `Report` of what each part of the matcher earns."""
    scenes, skipped = request.scenes()
    sequences, missing = request.sequences(scenes)
    sequences = [one for one in sequences if len(one.scored)]
    with opencv_threads(1):
        still = [on_scene(scene, request) for scene in request.follow(scenes, 'scenes')]
        moving = [on_sequence(sequence, request)
                  for sequence in request.follow(sequences, 'sequences')]
    settings = {
        **environment('one each'),
        'as it is': f'{request.subject}, filled; on single scenes cold',
        'rival': f'{RIVAL}, tuned for the family, dense; its fitness is that of its map in whole '
                 'pixels',
        'error': 'percent of pixels off by more than 1 px (Middlebury, made; pixels that both '
                 'cameras see) or 3 px (KITTI; all with truth); after the same refinement',
        'fitness': 'of the best chromosome before refinement, by the fitness of the matcher as it '
                   'is, measured everywhere; 1 would be fully possible and smooth',
        'time': f'all variants in turns; scenes: minimum of {TURNS}; sequences: median of the '
                'frames after the first; the replaced possibility is written to compare, not to '
                'be fast: no times of it',
        'sequences': 'those of the benchmark `warm`, scored as there',
    }
    found = ablation_tables.tables(still, moving, REALTIME)
    pictures, lacking = as_svg('ablation.svg', partial(ablation_picture.draw, found))
    return Report('ablation', 'Ablation', settings, found, [*skipped, *missing, *lacking],
                  pictures)


def on_scene(scene, request):
    """Return the `StillResult` of one scene."""
    known = scene.read()
    matchers = {variant.name: _matcher(variant, scene, request)
                for variant in REALTIME if variant.still}
    seen, matches = {}, {name: [] for name in matchers}

    def observe(_, population):
        seen.update({member.tobytes(): member.copy() for member in population})

    for turn in range(TURNS + 1):       # the first takes memory and looks, the others are timed
        for name, matcher in matchers.items():
            matcher.reset()
            matches[name].append(matcher.match(known.left, known.right,
                                               observe=None if turn else observe))
    judge = matchers[DEFAULT.name]
    trials = {}
    for name, matcher in matchers.items():
        observe(None, matcher.algorithm.population.genes[:1])
        trials[name] = Trial(
            bad_percent(matches[name][-1].disparity, known, scene.limit),
            judge.algorithm.fitness_of(matcher.algorithm.population.genes[0]),
            min(match.times['total'] for match in matches[name][1:]))
    rival, trials[rival.name] = _rival(scene, known, judge)
    points = [Point(judge.algorithm.fitness_of(genes),
                    bad_percent(genes.astype(np.float32), known, scene.limit))
              for genes in seen.values()]
    return StillResult(scene, trials, points, truth_beside_result(scene, known, judge))


def _rival(scene, known, judge):
    """Return OpenCV's matcher and its `Trial`."""
    rival = next(one for one in tuned_rivals(scene.family) if one.algorithm == RIVAL)
    found = dense(rival.match(known.left, known.right, scene.disparities))
    return rival, Trial(bad_percent(found, known, scene.limit),
                        judge.algorithm.fitness_of(genes_of(found, judge)))


def on_sequence(sequence, request):
    """Return the `MovingResult` of one sequence."""
    frames = sequence.read()
    matchers = {variant.name: _matcher(variant, sequence, request)
                for variant in REALTIME if variant.moving}
    judge = matchers[DEFAULT.name]
    matches, fitness = ({name: [] for name in matchers} for _ in range(2))
    for known in frames:
        for name, matcher in matchers.items():
            matches[name].append(matcher.match(known.left, known.right))
            fitness[name].append(judge.algorithm.fitness_of(matcher.algorithm.population.genes[0]))
    scored = [number for number in sequence.scored if frames[number].truth is not None]
    first = max(1, sequence.scored.start)
    return MovingResult(
        sequence,
        {name: Trial(_mean(bad_percent(found[number].disparity, frames[number], sequence.limit)
                           for number in scored),
                     _mean(fitness[name][number] for number in scored),
                     float(np.median([match.times['total'] for match in found[1:]])))
         for name, found in matches.items()},
        {name: _mean(flicker(found[number - 1].disparity, found[number].disparity,
                             (0, -sequence.pan))
                     for number in range(first, len(frames)) if sequence.flickers)
         for name, found in matches.items()})


def _matcher(variant, scene, request):
    return StereoMatcher(request.config(scene.disparities, **variant.changes), variant.stages)


def _mean(values):
    values = list(values)
    return float(np.mean(values)) if values else float('nan')
