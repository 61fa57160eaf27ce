# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
What the fitness says of the ground truth: whether it is fitter than the result, and stays.

The distance between where evolution ends from the usual start and from the truth is what the
fitness, and not the search, still owes.
"""
from fuzzy_stereo_ros.evaluation.baselines import opencv_threads
from fuzzy_stereo_ros.evaluation.ground_truth import bad_percent, KITTI
from fuzzy_stereo_ros.evaluation.matchers import Ours
from fuzzy_stereo_ros.evaluation.report import environment, Report, Table
from fuzzy_stereo_ros.matching.evolution import Budget, Random
import numpy as np

GROUPS = 'middv2', 'midd2001', 'midd2006_third'     # whose truth is dense


def run(request):
    """Return the `Report` of the truth beside the result of the profile `quality`."""
    scenes, skipped = request.scenes()
    dense = [scene for scene in scenes if scene.group in GROUPS] or scenes[:1]
    with opencv_threads(1):
        rows = [truth_row(scene) for scene in request.follow(dense, 'truth')]
    means = [float(np.mean([row[place] for row in rows])) for place in (1, 2, 3)]
    settings = {
        **environment('one'),
        'error': 'percent of pixels that both cameras see off by more than 1 px, before '
                 'refinement',
        'from the truth': 'the left map starts from the truth, and from the result where it is '
                          'unknown; the right one from the result; one chromosome, as many '
                          'generations',
        'fitness': 'of the left map, from the truth with the trust that it ended with',
    }
    return Report('truth', 'Truth against result, profile quality', settings, [Table(
        'The truth beside the result', (
            '', 'result: error [%]', 'from the truth: error [%]', 'distance', 'result: fitness',
            'truth: fitness', 'from the truth: fitness'),
        [*rows, ('mean', *means, None, None, None)],
        'Where the truth is less fit than the result, the fitness prefers what is wrong, or what '
        'the truth, in steps of a part of a pixel, cannot be.', digits=3)], skipped)


def truth_row(scene):
    """Return the row of a scene."""
    pair = scene.read()
    matcher = Ours('quality', 'quality').matcher(scene.disparities)
    matcher.match(pair.left, pair.right)
    algorithm = matcher.algorithm
    result, there = algorithm.fittest().copy(), np.isfinite(pair.truth)
    truth = np.where(there, np.where(there, pair.truth, 0), result)
    fitness = [algorithm.fitness_of(result), algorithm.fitness_of(truth)]
    evolved = algorithm.evolved_from(truth, Random((matcher.config.seed, 1)),
                                     Budget(matcher.config.generations, 0, 0))
    errors = [bad_percent(one, pair, scene.limit) for one in (result, evolved)]
    return (scene.path, *errors, errors[0] - errors[1], *fitness,
            float(algorithm.population.fitness[0]))


def genes_of(disparity, matcher):
    """
    Return a map as a chromosome of a matcher of `realtime`: whole pixels, those it can have.

    disparity: (R, C), px, from 0; matcher: a StereoMatcher that has matched a pair
    """
    genes = matcher.algorithm.population.genes
    return np.clip(np.rint(disparity), 0, matcher.config.disparities - 1).astype(genes.dtype)


def truth_beside_result(scene, pair, matcher):
    """
    Return the fitness of the ground truth, and the error that the truth would leave.

    The truth is taken in whole pixels, and the fittest's genes where it is unpair. What it would
    leave: the fittest is crossed with the truth of its wrong cells. NaN for KITTI, whose truth
    has no regions.

    scene: a `Scene`; pair: its `GroundTruthPair`; matcher: of `realtime`, that has just matched it
    """
    if scene.family == KITTI:
        return float('nan'), float('nan')
    fittest, there = matcher.algorithm.population.genes[0], np.isfinite(pair.truth)
    right = genes_of(np.where(there, pair.truth, 0), matcher)
    wrong = there & ~(abs(fittest - pair.truth) <= scene.limit)
    child = matcher.algorithm.child_of(fittest, np.where(wrong, right, fittest))
    return (matcher.algorithm.fitness_of(np.where(there, right, fittest)),
            bad_percent(child.astype(np.float32), pair, scene.limit))
