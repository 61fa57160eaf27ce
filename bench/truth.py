# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Fitness against error: whether a fitter map is better, and the truth fitter than the result.

Evolution starts from the truth too, and its end is compared with the end from the usual start.
"""
from bench.request import report_of
from bench.scoring import bad_percent
from fuzzy_stereo_ros.evaluation.ground_truth import KITTI
from fuzzy_stereo_ros.evaluation.matchers import Ours
from fuzzy_stereo_ros.evaluation.report import Table
from fuzzy_stereo_ros.matching.crossover import Regions
from fuzzy_stereo_ros.matching.evolution import Budget, evolve, Random
from fuzzy_stereo_ros.matching.quality.operators import OPERATORS
from fuzzy_stereo_ros.matching.quality.planes import local_planes
from fuzzy_stereo_ros.matching.realtime.matcher import ADVANTAGE
import numpy as np
import pandas as pd

GROUPS = 'middv2', 'midd2001', 'midd2006_third'     # whose truth is dense
NEAR_THE_END = 0.25     # share of the chromosomes, the fittest, in which fitness matters most
FEWEST = 4              # chromosomes for a correlation


def run(request):
    """Return the `Report` of the truth beside the result of the profile `quality`."""
    scenes, skipped = request.scenes()
    dense = [scene for scene in scenes if scene.group in GROUPS] or scenes[:1]
    rows = request.each(dense, 'truth', truth_row)
    means = [float(np.mean([row[place] for row in rows])) for place in (1, 2, 3)]
    settings = {
        'error': 'percent of pixels that both cameras see off by more than 1 px, before '
                 'refinement',
        'from the truth': 'the left map starts from the truth, and from the result where it is '
                          'unknown; the right one from the result; one chromosome, as many '
                          'generations',
        'fitness': 'of the left map, from the truth with the trust that it ended with',
    }
    return report_of('truth', 'Truth against result, profile quality', settings, [Table(
        'The truth beside the result', (
            '', 'result: error [%]', 'from the truth: error [%]', 'distance', 'result: fitness',
            'truth: fitness', 'from the truth: fitness'),
        [*rows, ('mean', *means, None, None, None)],
        'Where the truth is less fit than the result, the fitness prefers what is wrong, or what '
        'the truth, in steps of a part of a pixel, cannot be.', digits=3)], skipped, threads='one')


def truth_row(scene):
    """Return the row of a scene in the table of the truth beside the result."""
    pair = scene.read()
    matcher = Ours('quality', 'quality').matcher(scene.disparities)
    matcher.match(pair.left, pair.right)
    algorithm = matcher.algorithm
    result, there = algorithm.population.views[0].disparities, np.isfinite(pair.truth)
    truth = np.where(there, np.where(there, pair.truth, 0), result)
    fitness = [algorithm.fitness_of(result), algorithm.fitness_of(truth)]
    evolved = evolved_from(truth, matcher)
    errors = [bad_percent(one, pair, scene.limit) for one in (result, evolved)]
    return (scene.path, *errors, errors[0] - errors[1], *fitness,
            float(algorithm.population.fitness[0]))


def evolved_from(disparity, matcher, generations=None):
    """
    Return the map that evolution reaches on the last pair from another left map: float32 (R, C).

    disparity: float32 (R, C), px from 0, as the result; the right map starts from the current one.
    matcher: a StereoMatcher of profile `quality`. generations: None for as many as it has
    """
    population, config = matcher.algorithm.population, matcher.config
    left, right = population.views
    population.initialise([local_planes(left.pool, np.float32(disparity), left.colour),
                           right.planes.copy()])
    evolve(population, OPERATORS, Random((config.seed, 1)),
           Budget(config.generations if generations is None else generations, 0, 0))
    population.tools.release()
    return left.disparities


def genes_of(disparity, matcher):
    """
    Return a map as a chromosome of profile `realtime`: in whole pixels, clipped to its range.

    disparity: (R, C), px, from 0. matcher: a StereoMatcher that has matched a pair.
    """
    genes = matcher.algorithm.population.genes
    return np.clip(np.rint(disparity), 0, matcher.config.disparities - 1).astype(genes.dtype)


def truth_beside_result(scene, pair, matcher):
    """
    Return {'truth': fitness of the ground truth, 'left': error after crossover with it}.

    The truth is rounded to whole pixels; where it is unknown, genes are those of the fittest. For
    `left` the fittest is crossed with the truth of its wrong cells, and replaced. NaN for KITTI,
    whose truth is too sparse. scene: a `Scene`. pair: its `GroundTruthPair`. matcher: a
    StereoMatcher of profile `realtime` that has just matched the pair.
    """
    if scene.family == KITTI:
        return {'truth': np.nan, 'left': np.nan}
    algorithm, genes = matcher.algorithm, matcher.algorithm.population.genes[0]
    fittest, there = genes.copy(), np.isfinite(pair.truth)
    right = genes_of(np.where(there, pair.truth, 0), matcher)
    wrong = there & ~(abs(fittest - pair.truth) <= scene.limit)
    algorithm.population.accept(algorithm.pool, Regions(*genes.shape, advantage=ADVANTAGE), None,
                                np.where(wrong, right, fittest))
    return {'truth': algorithm.fitness_of(np.where(there, right, fittest)),
            'left': bad_percent(genes.astype(np.float32), pair, scene.limit)}


def spearman(points):
    """
    Return the rank correlation of fitness and -error: 1 if a fitter map is always better.

    points: DataFrame with the columns fitness and error. NaN if they are few or equal.
    """
    if len(points) < FEWEST or points.fitness.nunique() < 2 or points.error.nunique() < 2:
        return float('nan')
    return float(-points.fitness.rank().corr(points.error.rank()))


def fittest(points, share=NEAR_THE_END):
    """Return a share of the points, the fittest ones; ties go to the larger error."""
    return points.nlargest(int(np.ceil(share * len(points))), ['fitness', 'error'])


def correlation_table(points, truths):
    """
    Return the table of correlations by scene, with their mean and that of all scenes together.

    points: DataFrame of chromosomes: scene, fitness, and error in percent.
    truths: DataFrame of scenes with the figures of `truth_beside_result`.
    """
    rows = {}
    for scene, one in points.groupby('scene', sort=False):
        best = fittest(one)
        rows[scene] = {
            'chromosomes': len(one), 'correlation': spearman(one),
            'of the fittest quarter': spearman(best), 'fittest: fitness': best.fitness.iloc[0],
            'its error [%]': best.error.iloc[0], 'least error [%]': one.error.min()}
    table = pd.DataFrame(rows).T.join(truths.set_index('scene').rename(
        columns={'truth': 'truth: fitness', 'left': 'left by the truth [%]'}))
    table.loc['mean of scenes'] = table.mean().drop(
        ['chromosomes', 'fittest: fitness', 'truth: fitness'])
    ranked = points.groupby('scene')[['fitness', 'error']].rank(pct=True)
    for name, pooled in (('all, ranked within their scene', ranked), ('all, as they are', points)):
        table.loc[name, ['chromosomes', 'correlation']] = len(pooled), spearman(pooled)
    table['chromosomes'] = table.chromosomes.astype('Int64')
    return Table.of(
        'Rank correlation of fitness and error', table,
        'Spearman, 1 where a fitter chromosome never has the larger error; errors of chromosomes '
        'before refinement. *Truth*: in whole pixels, with genes of the matcher as it is where '
        'it is unknown; where it is less fit than the result, the fitness prefers what is '
        'wrong. *Left by the truth*: the error of the matcher as it is, crossed with the truth of '
        'its wrong cells: what a perfect search would leave, as the fitness does not take it.',
        digits=3)
