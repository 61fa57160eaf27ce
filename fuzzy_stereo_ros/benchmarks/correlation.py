# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Does fitness tell which map is better? The rank correlation of fitness and error."""
from fuzzy_stereo_ros.evaluation.report import mean, Table
import numpy as np
import pandas as pd
from scipy.stats import spearmanr

NEAR_THE_END = 0.25     # share of the chromosomes, the fittest, in which fitness matters most
FEWEST = 4              # chromosomes that a correlation is worth printing of


def spearman(points):
    """
    Return the rank correlation of fitness and -error: 1 where fitter is always better.

    points: DataFrame with the columns fitness and error. NaN of few points, or of equal ones.
    """
    if len(points) < FEWEST or points.fitness.nunique() < 2 or points.error.nunique() < 2:
        return float('nan')
    return float(-spearmanr(points.fitness, points.error).statistic)


def fittest(points, share=NEAR_THE_END):
    """Return the share of the points that are fittest, those of equal fitness by their error."""
    return points.nlargest(int(np.ceil(share * len(points))), ['fitness', 'error'])


def correlation_table(points, truths):
    """
    Return the table of correlations by scene, their mean, and that of all scenes in one.

    points: {scene: [(fitness, error in percent)] of different chromosomes}.
    truths: {scene: the two figures of `truth_beside_result`}.
    """
    pooled = pd.DataFrame([(scene, *point) for scene, several in points.items()
                           for point in several], columns=['scene', 'fitness', 'error'])
    ranked = pooled.groupby('scene')[['fitness', 'error']].rank(pct=True)
    rows = []
    for scene, one in pooled.groupby('scene', sort=False):
        best = fittest(one).iloc[0]
        rows.append((scene, len(one), spearman(one), spearman(fittest(one)), float(best.fitness),
                     float(best.error), float(one.error.min()), *truths[scene]))
    means = [mean(row[place] for row in rows) for place in (2, 3, 5, 6, 8)]
    rows += [('mean of scenes', None, *means[:2], None, *means[2:4], None, means[4]),
             ('all, ranked within their scene', len(ranked), spearman(ranked), *(None,) * 6),
             ('all, as they are', len(pooled), spearman(pooled), *(None,) * 6)]
    return Table(
        'Rank correlation of fitness and error', (
            '', 'chromosomes', 'correlation', 'of the fittest quarter', 'fittest: fitness',
            'its error [%]', 'least error [%]', 'truth: fitness', 'left by the truth [%]'), rows,
        'Spearman, 1 where a fitter chromosome never has the larger error; errors of chromosomes '
        'before refinement. *Truth*: in whole pixels, with genes of the matcher as it is where '
        'it is unknown; where it is less fit than the result, the fitness prefers what is '
        'wrong. *Left by the truth*: the error of the matcher as it is, crossed with the truth of '
        'its wrong cells: what a perfect search would leave, as the fitness does not take it.',
        digits=3)
