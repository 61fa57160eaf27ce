# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Points nearer than the disparity range: they are searched, rejected and counted.

Not in the paper. A pixel whose match lies beyond the range takes a wrong label of the range, most
often one of the last: the nearest obstacle would seem farther away. So a few more labels are
searched, and pixels that take one of them are rejected. The profile `paper` searches the range
alone, as the paper does.
"""
from dataclasses import replace
from functools import lru_cache

from fuzzy_stereo_ros.matching.kernels.refinement.consistency import reject_nearer
import numpy as np

EXTRA_LABELS = 8    # labels beyond the range that are searched
MOST_DISPARITIES = 4096     # that a MatcherConfig allows
AT_THE_END = 0.1    # share in the last quarter of the margin from which the margin is too short
FURTHER = 4 / 3     # factor of the range that is proposed where the margin is too short
MULTIPLE = 16       # of which a proposed number of disparities is one, as OpenCV needs it


@lru_cache(16)
def searched(config, columns):
    """Return the MatcherConfig for the search of images of a number of columns, with filling."""
    fill = config.fill or config.fill_holes > 0
    if config.algorithm == 'paper':
        return replace(config, fill=fill)
    wanted = config.disparities + EXTRA_LABELS
    most = max(min(wanted, columns, MOST_DISPARITIES), config.disparities)
    return replace(config, disparities=most, fill=fill)


def reject_beyond(pool, config, most, match):
    """
    Reject the disparities beyond the range of a MatcherConfig; return what a Match says of them.

    Pixels with the last label searched are rejected and not counted: equal costs give the nearest
    label, so that areas that match everywhere, such as burnt-out sky, have it with any range.
    most: disparities that were searched, see `searched`; match: the `Match` of these, whose
    arrays are overwritten. Returns {field of the Match: value}.
    """
    highest = np.float32(config.min_disparity + config.disparities - 1)
    bands = pool.parts(len(match.disparity))
    counts = np.zeros((len(bands), EXTRA_LABELS + 1), np.int64)
    pool.each(lambda band: reject_nearer(
        match.disparity, match.confidence, highest, counts[band[0]], band[1], band[2]), bands)
    within, *beyond = counts.sum(axis=0)[:max(most - config.disparities, 1)].tolist()
    number = sum(beyond)
    return {'beyond': number / max(number + within, 1),
            'needed_disparities': _needed_disparities(config.disparities, beyond)}


def _needed_disparities(disparities, beyond):
    """Return the range that includes pixels beyond: [number 1 label beyond, 2 labels ...]."""
    number = sum(beyond)
    if not number:
        return disparities
    if sum(beyond[-EXTRA_LABELS // 4:]) > AT_THE_END * number:
        wanted = max(FURTHER * disparities, disparities + EXTRA_LABELS)
    else:
        wanted = disparities + max(away for away, found in enumerate(beyond, 1) if found)
    return proposed(wanted)


def proposed(wanted):
    """Return the number of disparities to propose where so many are wanted, of any type: int."""
    return min(int(-(-wanted // MULTIPLE)) * MULTIPLE, MOST_DISPARITIES)
