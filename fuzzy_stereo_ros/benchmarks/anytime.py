# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Anytime: error and fitness against milliseconds, as evolution goes on from several populations.

What counts is the chromosome itself, before refinement.
"""
from dataclasses import dataclass, field
from functools import partial
import time

from fuzzy_stereo_ros.benchmarks import anytime_picture
from fuzzy_stereo_ros.benchmarks.correlation import correlation_table, Point
from fuzzy_stereo_ros.benchmarks.datasets import Scene
from fuzzy_stereo_ros.benchmarks.paper_tables import fastest
from fuzzy_stereo_ros.benchmarks.picture import as_svg
from fuzzy_stereo_ros.benchmarks.truth import genes_of, truth_beside_result
from fuzzy_stereo_ros.evaluation.baselines import dense, opencv_threads, tuned_rivals
from fuzzy_stereo_ros.evaluation.ground_truth import bad_percent
from fuzzy_stereo_ros.evaluation.report import environment, Report, Table
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
import numpy as np

CLASSIC, MODERN, MADE = 'middv2', 'midd2006_third', 'made'
CHECKPOINTS = (20, 50, 100, 200, 500, 1000, 2000, 5000, 10000)    # milliseconds
QUICK_CHECKPOINTS = (1, 20, 60)
RIVAL, RIVAL_TURNS = '3WAY', 3


@dataclass(frozen=True)
class Start:
    """Where an evolution starts: a profile, and changes of its parameters."""

    name: str
    profile: str
    changes: dict = field(default_factory=dict)


STARTS = (
    Start('paper', 'paper', {'generations': 200}),
    Start('quality', 'quality'),
    Start('realtime', 'realtime'),
)


@dataclass(frozen=True)
class Stand:
    """What a start had reached after some milliseconds: fitness, and error in percent."""

    milliseconds: float
    fitness: float
    error: float


@dataclass(frozen=True)
class Courses:
    """
    What was found on a scene: {name of start: list of `Stand`, in order of time}.

    rival: the one `Stand` of OpenCV's matcher. truth: the two figures
    of `truth_beside_result`.
    """

    scene: Scene
    stands: dict
    rival: Stand
    truth: tuple


def run(request):
    """Return the `Report` of how soon each kind of population arrives where."""
    scenes, skipped = request.scenes()
    shown, reason = _shown(scenes)
    checkpoints = QUICK_CHECKPOINTS if request.quick else CHECKPOINTS
    with opencv_threads(1):
        found = [measure(scene, checkpoints[-1]) for scene in request.follow(shown, 'anytime')]
    settings = {
        **environment('one each'),
        **{start.name: f'profile {start.profile}' + ''.join(
            f', {name} = {value}' for name, value in start.changes.items()) for start in STARTS},
        'rival': f'{RIVAL}, tuned for the family, dense, minimum of {RIVAL_TURNS} turns',
        'error': 'of the chromosome itself, without refinement: percent of pixels off by more '
                 'than 1 px (Middlebury, made) or 3 px (KITTI)',
        'fitness': 'that of profile realtime, cold, in whole pixels, measured everywhere, of all '
                   'alike',
    }
    pictures, missing = as_svg('anytime.svg', partial(anytime_picture.draw, found))
    return Report('anytime', 'Anytime', settings, tables(found, checkpoints),
                  [*skipped, *reason, *missing], pictures)


def _shown(scenes):
    """Return the classic pairs and one of 2006, else made ones, else what there is."""
    classic = [scene for scene in scenes if scene.group == CLASSIC]
    modern = [scene for scene in scenes if scene.group == MODERN][:1]
    if classic or modern:
        return classic + modern, []
    shown = [scene for scene in scenes if scene.group == MADE] or scenes[:1]
    return shown, [f'the classic pairs: {shown[0].group} instead']


def measure(scene, longest):
    """Return the `Courses` of one scene; longest: milliseconds of each."""
    known = scene.read()
    judge = StereoMatcher(MatcherConfig(disparities=scene.disparities, threads=1))
    judge.match(known.left, known.right)

    def stand(milliseconds, genes):
        whole = genes_of(genes, judge)
        return Stand(milliseconds, judge.algorithm.fitness_of(whole),
                     bad_percent(genes.astype(np.float32), known, scene.limit))

    stands = {start.name: [stand(*noted) for noted in course_of(start, scene, known, longest)]
              for start in STARTS}
    rival = next(one for one in tuned_rivals(scene.family) if one.algorithm == RIVAL)
    milliseconds, disparity = fastest(RIVAL_TURNS, lambda: dense(
        rival.match(known.left, known.right, scene.disparities)))
    return Courses(scene, stands, stand(milliseconds, disparity),
                   truth_beside_result(scene, known, judge))


def course_of(start, scene, known, longest):
    """Return [(milliseconds, chromosome)] of the fittest after each generation on a pair."""
    matcher = StereoMatcher(MatcherConfig.from_profile(start.profile, **{
        'reference': 'left', 'disparities': scene.disparities, 'threads': 1,
        'deadline_ms': float(longest), **start.changes}))
    matcher.warm_up(*known.left.shape[:2])
    notes = []

    def observe(_, genes):
        best = genes[matcher.algorithm.population.best]
        notes.append(((time.perf_counter_ns() - begun) / 1e6, best.copy()))

    begun = time.perf_counter_ns()
    matcher.match(known.left, known.right, observe=observe)
    return notes


def tables(found, checkpoints):
    """Return the tables of a list of `Courses`; checkpoints: milliseconds."""
    made = []
    for title, figure, digits in (('error in percent', 'error', 2), ('fitness', 'fitness', 4)):
        rivals = [getattr(courses.rival, figure) for courses in found]
        made.append(Table(
            f'Mean of {len(found)} scenes: {title}', _headings(checkpoints),
            [(start.name, *(_mean_at(found, start.name, limit, figure) for limit in checkpoints))
             for start in STARTS],
            f'{RIVAL}: {np.mean(rivals):.{digits}f} after '
            f'{np.mean([courses.rival.milliseconds for courses in found]):.0f} ms.', digits))
    for courses in found:
        made.append(Table(
            f'{courses.scene.path}: error in percent / fitness', _headings(checkpoints),
            [(name, *(_word(stand_at(stands, limit)) for limit in checkpoints))
             for name, stands in courses.stands.items()],
            f'{RIVAL}: {_word(courses.rival)} after {courses.rival.milliseconds:.0f} ms.'))
    points = {courses.scene.path: list(dict.fromkeys(
        Point(stand.fitness, stand.error) for stands in courses.stands.values()
        for stand in stands)) for courses in found}
    made.append(correlation_table(points,
                                  {courses.scene.path: courses.truth for courses in found}))
    return made


def stand_at(stands, milliseconds):
    """Return the last of some `Stand`s that was reached by then, None where none was."""
    return next((stand for stand in reversed(stands) if stand.milliseconds <= milliseconds), None)


def _headings(checkpoints):
    return ('', *(f'{milliseconds} ms' for milliseconds in checkpoints))


def _mean_at(found, name, milliseconds, figure):
    """Return the mean of a figure; None where a scene has nothing yet."""
    stands = [stand_at(courses.stands[name], milliseconds) for courses in found]
    return None if None in stands else float(np.mean([getattr(one, figure) for one in stands]))


def _word(stand):
    return None if stand is None else f'{stand.error:.2f} / {stand.fitness:.3f}'
