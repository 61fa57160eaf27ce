# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Does fitness tell which map is better? The rank correlation of fitness and error."""
from typing import NamedTuple

from fuzzy_stereo_ros.evaluation.report import Table
import numpy as np

NEAR_THE_END = 0.25     # share of the points, the fittest, in which fitness is put to the test
FEWEST = 4              # points that a correlation is worth printing of


class Point(NamedTuple):
    """The fitness of a chromosome, higher is fitter, and its error in percent."""

    fitness: float
    error: float


def ranks(values):
    """Return the ranks of values from 1, equal ones sharing the mean of theirs: float64 (N,)."""
    _, level, count = np.unique(values, return_inverse=True, return_counts=True)
    return (np.cumsum(count) - (count - 1) / 2)[level]


def spearman(points):
    """Return the rank correlation of fitness and -error: 1 where fitter is always better."""
    if len(points) < FEWEST:
        return float('nan')
    fitness, error = (ranks(values) for values in zip(*points))
    if fitness.std() == 0 or error.std() == 0:
        return float('nan')
    return -float(np.corrcoef(fitness, error)[0, 1])


def fittest(points, share=NEAR_THE_END):
    """Return the share of the points that are fittest."""
    return sorted(points, reverse=True)[:int(np.ceil(share * len(points)))]


def correlation_table(points, truths):
    """
    Return the table of correlations by scene, their mean, and that of all scenes in one.

    points: {scene: list of different `Point`s}. truths: {scene: the two figures of
    `truth_beside_result`}.
    """
    rows = []
    for scene, found in points.items():
        fittest_one, best = max(found), min(found, key=lambda point: point.error)
        rows.append((scene, len(found), spearman(found), spearman(fittest(found)),
                     fittest_one.fitness, fittest_one.error, best.error, *truths[scene]))
    means = [_mean([row[place] for row in rows]) for place in (2, 3, 5, 6, 8)]
    together = [relative for found in points.values() for relative in _in_ranks(found)]
    pooled = [point for found in points.values() for point in found]
    rows += [('mean of scenes', None, *means[:2], None, *means[2:4], None, means[4]),
             ('all, ranked within their scene', len(together), spearman(together), *(None,) * 6),
             ('all, as they are', len(pooled), spearman(pooled), *(None,) * 6)]
    return Table(
        'Rank correlation of fitness and error', (
            '', 'chromosomes', 'correlation', 'of the fittest quarter', 'fittest: fitness',
            'its error [%]', 'least error [%]', 'truth: fitness', 'left by the truth [%]'), rows,
        'Spearman, 1 where a fitter chromosome never has the larger error; errors of chromosomes '
        'before refinement. *Truth*: in whole pixels, with genes of the matcher as it is where '
        'it is unknown; where it is less fit than what was found, the fitness prefers what is '
        'wrong. *Left by the truth*: the error of the matcher as it is, crossed with the truth of '
        'its wrong cells: what a perfect search would leave, as the fitness does not take it.',
        digits=3)


def _in_ranks(found):
    """Return points whose fitness and error are ranks within the scene, 0 to 1."""
    fitness, error = (ranks(values) / len(found) for values in zip(*found))
    return [Point(*pair) for pair in zip(fitness, error)]


def _mean(values):
    """Return the mean of what is known; NaN of nothing."""
    known = [value for value in values if not np.isnan(value)]
    return float(np.mean(known)) if known else float('nan')
