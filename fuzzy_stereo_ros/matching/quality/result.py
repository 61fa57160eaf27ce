# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""From the fittest plane maps of both views to disparities and confidence."""
import cv2
from fuzzy_stereo_ros.matching.bands import cut_bands
from fuzzy_stereo_ros.matching.kernels.planes.costs import UNIT
from fuzzy_stereo_ros.matching.kernels.possibility.fuzzy_costs import FULL
from fuzzy_stereo_ros.matching.kernels.refinement.consistency import compare_views
from fuzzy_stereo_ros.matching.kernels.refinement.subpixel import AROUND
from fuzzy_stereo_ros.matching.kernels.units import CONSISTENT
from fuzzy_stereo_ros.matching.quality.fitness import SUPPORT_RADIUS, SUPPORT_STRIDE
from fuzzy_stereo_ros.matching.quality.planes import planes_of, region_planes
from fuzzy_stereo_ros.matching.realtime.refinement import reject_speckles
import numpy as np

VIEWS_DIFFER = 1.0       # px by which the views may differ
SEED_NEAR, SEED_SHARE = 1.0, 0.7  # px within which the seed counts as well, and its share
FLAT, FLAT_SHARE = 0.3, 0.8      # px within which such a share of a segment lies in a plane
FLAT_LEAST, OFF_PLANE = 100, 0.5  # least trusted px of it; px from the plane that stay
ELSEWHERE = -8, -3, 3, 8  # px, where matches are compared with the one found
SUPPORT_REACH = SUPPORT_RADIUS * SUPPORT_STRIDE   # px that must lie within the other image too
FAINT = 0.004            # contrast with these at which certainty is one half
LEAST_SURE = 0.02        # mean certainty below which confidence is 0
# Share of right pixels in steps of 0.1 of certainty, see kernels/refinement/subpixel.py.
CALIBRATION = 0, 0.66, 0.8, 0.91, 0.95, 0.98, 0.997, 0.999, 1, 1, 1
CLEAR_MARGIN = 0.4       # summed cost, parts of FULL, by which the best label elsewhere is worse


def compare(pool, disparity, other, lowest):
    """Return the validity of each pixel by the mirrored other view's map: see compare_views."""
    validity = np.empty(disparity.shape, np.uint8)
    pool.each(lambda band: compare_views(
        disparity, other, lowest, np.float32(VIEWS_DIFFER), validity, band[1], band[2]),
        cut_bands(len(disparity)))
    return validity


def averaged_with_planes(view, disparity, surface, random):
    """
    Return disparities, averaged with the plane of their segment where most of it lies in one.

    A plane over a large region errs by less than its pixels do; a segment that is curved has too
    few pixels near any plane. surface: float32 (R, C), px, what the planes are fitted to
    """
    trusted, result = view.fitness.trusted, disparity
    for regions in view.segments[1:]:       # the finest are too small for that
        planes = region_planes(view.pool, surface, trusted, regions, random)
        plane = view.fitness.disparities(view.pool, planes_of(planes, regions.labels))
        apart = abs(plane - disparity)
        known, near = (np.add.reduceat(chosen.reshape(-1)[regions.pixels], regions.starts[:-1],
                                       dtype=np.int32)
                       for chosen in (trusted, trusted & (apart < FLAT)))
        flat = (known > FLAT_LEAST) & (near >= FLAT_SHARE * known)
        in_plane = flat[regions.labels] & (apart < OFF_PLANE)
        result = np.where(in_plane, (disparity + plane) / 2, result)
    return result


def certainty(view, seed, lowest):
    """
    Return the certainty of each single pixel of a view's map: float32 (R, C), 0 to 1.

    It is the product of the possibility, the margin of the label that the data alone give, and the
    contrast with nearer and farther matches; 0 where that label differs from the map.
    """
    disparity = view.disparities
    possible = 1 - view.match_costs.astype(np.float32) / UNIT
    margins = seed.margins.astype(np.float32)
    alone = margins / (margins + np.float32(CLEAR_MARGIN * FULL))
    unlike = contrast(view, disparity, lowest)
    return (possible * alone * (unlike / (unlike + np.float32(FAINT)))
            * (abs(disparity - seed.labels) <= VIEWS_DIFFER))


def contrast(view, disparity, lowest):
    """
    Return how much less possible other matches are than a view's: float32 (R, C), 0 to 1.

    It is the mean over the matches ELSEWHERE that lie within the images and the disparities; 1
    where too few disparities are searched to have any.
    """
    highest = view.fitness.disparities_searched - 1
    pointed = np.arange(disparity.shape[1]) - lowest - disparity
    total, number = (np.zeros(disparity.shape, np.float32) for _ in range(2))
    moved = view.planes.copy()
    for away in ELSEWHERE:
        np.add(view.planes[:, 2], np.float32(away), out=moved[:, 2])
        inside = ((disparity + away >= 0) & (disparity + away <= highest)
                  & (pointed - away >= SUPPORT_REACH)
                  & (pointed - away < disparity.shape[1] - SUPPORT_REACH))
        excess = view.fitness.match_costs(view.pool, moved, inside) - view.match_costs
        total += np.where(inside, excess, 0)
        number += inside
    mean = np.maximum(total, 0) / (np.float32(UNIT) * np.maximum(number, 1))
    return mean if highest >= min(map(abs, ELSEWHERE)) else np.ones_like(mean)


def refine(pool, config, population, seed, random):
    """Return disparities, px, and confidence, 0 to 1: float32 (R, C); seed: of the left view."""
    left, right = population.views
    planes = left.disparities
    validity = compare(pool, planes, right.disparities, config.min_disparity)
    near = abs(planes - seed.surface) <= SEED_NEAR      # the seed errs otherwise than planes
    disparity = averaged_with_planes(
        left, planes + near * np.float32(SEED_SHARE) * (seed.surface - planes), seed.surface,
        random)
    if config.speckle_size > 1:
        reject_speckles(pool, np.rint(disparity).astype(np.int16), validity, config.speckle_range,
                        config.speckle_size)
    agreed = validity == CONSISTENT
    sure = certainty(left, seed, config.min_disparity) * agreed
    confidence = cv2.blur(sure, (AROUND, AROUND)) * agreed
    confidence[confidence < LEAST_SURE] = 0
    confidence = np.interp(10 * confidence, range(11), CALIBRATION).astype(np.float32)
    return without_uncertain(config, disparity + np.float32(config.min_disparity), confidence)


def without_uncertain(config, disparity, confidence):
    """Return disparities, NaN where they are too uncertain unless all are wanted; confidence."""
    if not config.fill:
        disparity[config.rejects(confidence)] = np.nan
    return disparity, confidence
