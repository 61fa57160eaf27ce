# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Anytime: error and fitness against milliseconds, as evolution goes on from several populations.

What counts is the chromosome itself, before refinement.
"""
from dataclasses import dataclass
import time

from fuzzy_stereo_ros.benchmarks.pictures import draw_anytime
from fuzzy_stereo_ros.benchmarks.request import report_of, Trial
from fuzzy_stereo_ros.benchmarks.truth import correlation_table, genes_of, truth_beside_result
from fuzzy_stereo_ros.evaluation.baselines import dense, tuned_3way
from fuzzy_stereo_ros.evaluation.datasets import Scene
from fuzzy_stereo_ros.evaluation.ground_truth import bad_percent
from fuzzy_stereo_ros.evaluation.matchers import fastest, Ours
from fuzzy_stereo_ros.evaluation.report import Table
import numpy as np

CLASSIC, MODERN, MADE = 'middv2', 'midd2006_third', 'made'
CHECKPOINTS = (20, 50, 100, 200, 500, 1000, 2000, 5000, 10000)    # milliseconds
QUICK_CHECKPOINTS = (1, 20, 60)
BASELINE_TURNS = 3
STARTS = (Ours('paper', 'paper', {'generations': 200}), Ours('quality', 'quality'),
          Ours('realtime', 'realtime'))


@dataclass(frozen=True)
class Curves:
    """
    The convergence curves of a scene.

    samples: {name of a start: `Trial`s in order of time}. baseline: the `Trial` of 3WAY.
    truth: the two figures of `truth_beside_result`.
    """

    scene: Scene
    samples: dict
    baseline: Trial
    truth: tuple


def run(request):
    """Return the `Report` of how soon each kind of population arrives where."""
    scenes, skipped = request.scenes()
    shown, reason = _shown(scenes)
    checkpoints = QUICK_CHECKPOINTS if request.quick else CHECKPOINTS
    found = request.each(shown, 'anytime', lambda scene: measure(scene, checkpoints[-1]))
    return report_of('anytime', 'Anytime', {
        **{start.name: f'profile {start.profile}' + ''.join(
            f', {name} = {value}' for name, value in start.changes.items()) for start in STARTS},
        'baseline': f'3WAY, tuned for the family, dense, minimum of {BASELINE_TURNS} turns',
        'error': 'of the chromosome itself, without refinement: percent of pixels off by more '
                 'than 1 px (Middlebury, made) or 3 px (KITTI)',
        'fitness': 'that of profile realtime, cold, in whole pixels, measured everywhere, of all '
                   'alike',
    }, tables(found, checkpoints), [*skipped, *reason],
        {'anytime.svg': lambda _: draw_anytime(found)})


def _shown(scenes):
    """Return the classic pairs and one of 2006, else synthetic ones, else what there is."""
    shown = [scene for scene in scenes if scene.group == CLASSIC]
    shown += [scene for scene in scenes if scene.group == MODERN][:1]
    if shown:
        return shown, []
    shown = [scene for scene in scenes if scene.group == MADE] or scenes[:1]
    return shown, [f'the classic pairs: {shown[0].group} instead']


def measure(scene, longest):
    """Return the `Curves` of one scene; longest: milliseconds of each."""
    pair = scene.read()
    judge = Ours('realtime').matcher(scene.disparities)
    judge.match(pair.left, pair.right)

    def sample(milliseconds, genes):
        return Trial(bad_percent(genes.astype(np.float32), pair, scene.limit),
                     judge.algorithm.fitness_of(genes_of(genes, judge)), milliseconds)

    samples = {start.name: [sample(*noted) for noted in curve_of(start, scene, pair, longest)]
               for start in STARTS}
    baseline = tuned_3way(scene.family)
    disparity, milliseconds = fastest(
        lambda: dense(baseline.match(pair.left, pair.right, scene.disparities)), BASELINE_TURNS,
        processor=True)
    return Curves(scene, samples, sample(milliseconds, disparity),
                  truth_beside_result(scene, pair, judge))


def curve_of(start, scene, pair, longest):
    """Return [(milliseconds, chromosome)] of the fittest after each generation on a pair."""
    matcher = start.matcher(scene.disparities, deadline_ms=float(longest))
    matcher.warm_up(*pair.left.shape[:2])
    notes = []

    def observe(_, genes):
        best = genes[matcher.algorithm.population.best]
        notes.append(((time.perf_counter_ns() - begun) / 1e6, best.copy()))

    begun = time.perf_counter_ns()
    matcher.match(pair.left, pair.right, observe=observe)
    return notes


def tables(found, checkpoints):
    """Return the tables of a list of `Curves`; checkpoints: milliseconds."""
    headings = ('', *(f'{milliseconds} ms' for milliseconds in checkpoints))
    times = np.mean([curves.baseline.milliseconds for curves in found])
    made = []
    for title, figure, digits in (('error in percent', 'error', 2), ('fitness', 'fitness', 4)):
        baseline = np.mean([getattr(curves.baseline, figure) for curves in found])
        made.append(Table(
            f'Mean of {len(found)} scenes: {title}', headings,
            [(start.name, *(_mean_at(found, start.name, limit, figure) for limit in checkpoints))
             for start in STARTS], f'3WAY: {baseline:.{digits}f} after {times:.0f} ms.', digits))
    for curves in found:
        made.append(Table(
            f'{curves.scene.path}: error in percent / fitness', headings,
            [(name, *(_word(sample_at(samples, limit)) for limit in checkpoints))
             for name, samples in curves.samples.items()],
            f'3WAY: {_word(curves.baseline)} after {curves.baseline.milliseconds:.0f} ms.'))
    return [*made, correlation_table(
        {curves.scene.path: list(dict.fromkeys(
            (sample.fitness, sample.error) for samples in curves.samples.values()
            for sample in samples)) for curves in found},
        {curves.scene.path: curves.truth for curves in found})]


def sample_at(samples, milliseconds):
    """Return the last of some samples that was reached by then, None where none was."""
    return next((one for one in reversed(samples) if one.milliseconds <= milliseconds), None)


def _mean_at(found, name, milliseconds, figure):
    """Return the mean of a figure; None where a scene has nothing yet."""
    samples = [sample_at(curves.samples[name], milliseconds) for curves in found]
    return None if None in samples else float(np.mean([getattr(one, figure) for one in samples]))


def _word(sample):
    return None if sample is None else f'{sample.error:.2f} / {sample.fitness:.3f}'
