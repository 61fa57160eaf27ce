# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Estimate which disparities a camera sees, from a few of its pairs.

Not in the paper. The pairs are reduced and searched over half of their width; the disparities of
confident pixels give the range. Then the whole pairs are matched, as hints would widen the range.
"""
from dataclasses import replace

import cv2
from fuzzy_stereo_ros.matching.config import MatcherConfig
from fuzzy_stereo_ros.matching.matcher import StereoMatcher
from fuzzy_stereo_ros.matching.out_of_range import MULTIPLE, proposed
from fuzzy_stereo_ros.matching.plausibility import PlausibilityCheck
import numpy as np

PAIRS = 5               # pairs that are searched
REDUCED_COLUMNS = 320   # of the reduced images
NEARER, FARTHER = 2, 16     # divide their width: searched above and below a disparity of 0
CONFIDENT = 0.9
PERCENTILES = 0.3, 99.9
RESERVE = 1.15          # times the largest disparity, as things come nearer than in a few pairs
UNSURE = 2.0            # px of the reduced images by which a range may be wrong
WIDENED = 5             # times at most that a range is widened
LEAST_SHARE = 0.02      # least share of confident pixels for a result


def seen_disparities(pairs, threads=0):
    """Return the least and largest disparity in pairs of images, px; None if few pixels tell."""
    found, config = [], MatcherConfig.from_profile('realtime', warm_start=False, threads=threads)
    for left, right in pairs:
        scale = min(1.0, REDUCED_COLUMNS / left.shape[1])
        small = [cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
                 for image in (left, right)]
        columns = small[0].shape[1]
        lowest = -(columns // FARTHER)
        match = StereoMatcher(replace(
            config, min_disparity=lowest, disparities=columns // NEARER - lowest)).match(*small)
        sure = match.disparity[(match.confidence >= CONFIDENT) & np.isfinite(match.disparity)]
        if sure.size >= LEAST_SHARE * match.disparity.size:
            found.append(np.percentile(sure, PERCENTILES) / scale + (0.0, UNSURE / scale))
    if not found:
        return None
    return float(min(low for low, _ in found)), float(max(high for _, high in found))


def search_range(pairs, threads=0):
    """
    Return (min_disparity, disparities) for pairs; arguments as for `seen_disparities`.

    What they show has a reserve, and is widened as the PlausibilityCheck proposes of any of them.
    0 is in the range, which then reaches to infinity, where no farther disparity is seen.
    """
    first, count = MatcherConfig.min_disparity, MatcherConfig.disparities
    if seen := seen_disparities(pairs, threads):
        low, high = seen
        first, count = range_from(low if low < -2 * UNSURE else 0, RESERVE * high)
    for _ in range(WIDENED):
        config = MatcherConfig(
            min_disparity=first, disparities=count, warm_start=False, threads=threads)
        matcher = StereoMatcher(config)
        found = [PlausibilityCheck().add(*pair, matcher.match(*pair), config) for pair in pairs]
        lows, highs = zip((first, first + count - 1), *(
            one.needed for one in found if one is not None and one.needed))
        wider = range_from(min(lows), max(highs))
        if wider == (first, count):
            break
        first, count = wider
    return first, count


def range_from(low, high):
    """Return (min_disparity, disparities) in MULTIPLEs that include disparities, px."""
    first = MULTIPLE * int(np.floor(low / MULTIPLE))
    return first, max(MULTIPLE, proposed(high + 1 - first))
