# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
What is nearer than the range: it is searched for, rejected and counted.

Not in the paper. A pixel whose match lies beyond the range takes some label of the range, most
often one of the last: the nearest obstacle is put farther away. So a few labels more are searched,
and what lands there is rejected. The profile `paper` searches the range alone, as the paper does.
"""
from dataclasses import replace

from fuzzy_stereo_ros.matching.bands import cut_bands
from fuzzy_stereo_ros.matching.kernels.refinement.consistency import reject_nearer
import numpy as np

MARGIN = 8          # labels beyond the range that are searched
MOST = 4096         # disparities that a MatcherConfig allows
AT_THE_END = 0.1    # share, in the last quarter of the margin, that says that it is too short
FURTHER = 4 / 3     # times the range, to be tried where the margin is too short
ROUND = 16          # ranges that are proposed are multiples of it, as OpenCV wants them


def searched(config, columns):
    """Return the MatcherConfig by which images of so many columns are searched, and filled."""
    fill = config.fill or config.fill_holes > 0
    if config.algorithm == 'paper':
        return replace(config, fill=fill)
    most = max(min(config.disparities + MARGIN, columns, MOST), config.disparities)
    return replace(config, disparities=most, fill=fill)


def reject_beyond(pool, config, most, match):
    """
    Return a match without what lies beyond the range of a MatcherConfig, and how much did.

    What has the last label that is searched is rejected and not counted: of equals the nearest is
    taken, so what fits anywhere, as burnt-out sky, has that label, whatever the range.
    most: disparities that were searched, see `searched`; match: the `Match` of these, whose
    arrays are overwritten
    """
    highest = np.float32(config.min_disparity + config.disparities - 1)
    bands = cut_bands(len(match.disparity))
    counts = np.zeros((len(bands), MARGIN + 1), np.int64)
    pool.each(lambda band: reject_nearer(
        match.disparity, match.confidence, highest, counts[band[0]], band[1], band[2]), bands)
    within, *beyond = counts.sum(axis=0)[:max(most - config.disparities, 1)].tolist()
    number = sum(beyond)
    return replace(match, beyond=number / max(number + within, 1),
                   enough=_enough(config.disparities, beyond))


def _enough(disparities, beyond):
    """Return the disparities that hold what is beyond: [number at 1 label, at 2 labels ...]."""
    number = sum(beyond)
    if not number:
        return disparities
    if sum(beyond[-MARGIN // 4:]) > AT_THE_END * number:
        wanted = max(FURTHER * disparities, disparities + MARGIN)
    else:
        wanted = disparities + max(away for away, found in enumerate(beyond, 1) if found)
    return min(int(-(-wanted // ROUND)) * ROUND, MOST)
