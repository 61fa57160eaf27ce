# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Sub-pixel disparities, the mean offset of similar neighbours of a pixel, and the output.

The output is disparity and confidence as the user gets them.
"""
from fuzzy_stereo_ros.matching.kernels.compiled import called, kernel
from fuzzy_stereo_ros.matching.kernels.simd import (
    add, add_floats, LANES, least_float, load, minimum, multiply_floats, saturating_subtract,
    splat, splat_like, store, subtract)
from fuzzy_stereo_ros.matching.kernels.units import CONSISTENT, INVALID, STEPS, VOTED
import numpy as np

RADIUS = 2
NEIGHBOURS = (2 * RADIUS + 1)**2    # of a pixel, itself too
INVALID_FIT = -(2**14)     # farther than STEPS from any disparity


@kernel
def fit(labels, offsets, validity, fitted, first, last):
    """
    Write the fitted disparities of the pixels not rejected, far out of reach for the others.

    fitted: int16 or int32 (R, C + 4 + 32), 1 / STEPS px, with a margin of RADIUS columns and slack
    behind
    """
    columns, none = labels.shape[1], np.int32(INVALID_FIT)
    for row in range(first, last):
        fitted[row, :RADIUS] = INVALID_FIT
        fitted[row, columns + RADIUS:] = INVALID_FIT
        inside, line = fitted[row, RADIUS:RADIUS + columns], labels[row]
        offset, valid = offsets[row], validity[row]
        for column in range(columns):       # LLVM 14 makes no vectors of this choice
            above = STEPS * np.int32(line[column]) + np.int32(offset[column]) - none
            inside[column] = none + np.int32(valid[column] != INVALID) * above


@kernel
def smooth_offsets(final, fitted, total, count, fine, agreeing, first, last):
    """
    Average over 5 x 5 pixels the fitted disparities that are within one pixel of the final label.

    final: labels after refinement; total, count: (C + 32,) of the dtype of fitted, working memory;
    fine: (R, C + 32) of that dtype, 1 / STEPS px; agreeing: uint8 (R, C), the number of fitted
    disparities, 1 at the least
    """
    rows, columns = final.shape
    source, target = fitted.reshape(-1), fine.reshape(-1)
    stride, fine_stride = fitted.shape[1], fine.shape[1]
    for row in range(first, last):
        centre = fine[row]
        for column in range(columns):
            centre[column] = STEPS * np.int32(final[row, column])
        above, below = max(row - RADIUS, 0), min(row + RADIUS + 1, rows)
        for column in range(0, columns, LANES):
            middle = load(target, row * fine_stride + column)
            lowest = subtract(middle, splat_like(middle, STEPS))
            one, behind = splat_like(middle, 1), splat_like(middle, 2 * STEPS + 1)
            left = number = subtract(one, one)
            for other in range(above, below):
                place = other * stride + column
                for shift in range(2 * RADIUS + 1):
                    # unsigned, what is below wraps around: 0 beyond one pixel, uncompared
                    within = saturating_subtract(
                        behind, subtract(load(source, place + shift), lowest))
                    left = add(left, within)
                    number = add(number, minimum(within, one))
            store(total, column, left)
            store(count, column, number)
        for column in range(columns):
            number = np.int32(count[column])
            least = max(number, np.int32(1))
            agreeing[row, column] = least
            mean = np.float32((STEPS + 1) * number - np.int32(total[column])) / np.float32(least)
            centre[column] += np.int32(np.floor(mean + np.float32(0.5)))


CLEAR_MARGIN = 24    # summed cost by which the best label elsewhere is worse: half sure
CERTAIN = 255 * 256   # of a label that is certain
CHANCE = 14          # margin of the half-size search that noise often reaches
NEVER = -1e9         # added to a score that leaves no confidence
AROUND = 9           # side of the square whose mean certainty a pixel's confidence is made of
# Share of right pixels, in steps of 0.1 of mean certainty times the share of agreeing neighbours.
# Calibrated on every other Middlebury scene and synthetic ones, colour and grey, with noise of 0,
# 1.5 and 3 grey levels, cold and warm, sharp and blurred; `python -m bench accuracy` prints how
# true it is on other scenes. Concave: confidence is the least of the lines, intercept and slope.
CALIBRATION = 0, 0.536, 0.692, 0.809, 0.905, 0.955, 0.986, 0.999, 1, 1, 1
LINES = np.column_stack((
    CALIBRATION[:-1] - np.arange(10) * np.diff(CALIBRATION),
    10 * np.diff(CALIBRATION) / (AROUND**2 * CERTAIN * NEIGHBOURS))).astype(np.float32)
LINES = LINES[LINES[:, 1] > 0]      # the others are 1, the most that confidence is


@kernel(allocates=True)
def certainty(sums, margins, half, validity, certain, first, last):
    """
    Compute the certainty of each label from its cost and its uniqueness margin.

    The margin counts up to three times that of the half-size search, less what chance gives: in
    that no previous frame and no choice of labels has part.

    sums: uint8 (R, C), the summed cost of the label; half: margins (r, c) of the half-size search,
    and the weights of its prior, uint8 (R, C); certain: uint16 (R, C), 0 to CERTAIN, 0 where not
    consistent
    """
    half_margins, weights = half
    columns, half_columns = sums.shape[1], half_margins.shape[1]
    # of its own: other threads read the rows of `certain` where bands overlap
    width = max(columns, 2 * half_columns)
    limits = np.empty(width, np.uint8)
    for row in range(first, last):
        clear, of_prior = half_margins[min(row // 2, half_margins.shape[0] - 1)], weights[row]
        for place in range(half_columns):
            above = np.int32(clear[place]) - CHANCE
            limits[2 * place] = limits[2 * place + 1] = min(max(3 * above, 0), 255)
        limits[2 * half_columns:] = limits[2 * half_columns - 1]
        for column in range(columns):       # always written: AVX2 masks no bytes
            limits[column] = 255 if of_prior[column] == VOTED else limits[column]
        for column in range(columns):
            possible = np.float32(256) - np.float32(sums[row, column])
            consistent = np.float32(validity[row, column] == CONSISTENT)
            margin = np.float32(min(margins[row, column], limits[column]))
            certain[row, column] = np.int32(
                possible * consistent * np.float32(CERTAIN / 256)
                * (margin / (margin + np.float32(CLEAR_MARGIN))))


@called
def _reflected(index, size):
    """Return the index inside of so many for one beyond their ends, which are not repeated."""
    while index < 0 or index >= size:
        index = 0 if size == 1 else -index if index < 0 else 2 * (size - 1) - index
    return index


@called
def _add_row(certain, row, sign, sums):
    """Add a row, reflected beyond the image, to the sums of columns, or take it off: sign -1."""
    line, inside = certain[_reflected(row, certain.shape[0])], sums[AROUND // 2:]
    for column in range(line.size):
        inside[column] += np.int32(sign) * np.int32(line[column])


@called
def _sum_line(sums, columns, line):
    """Write the sums of AROUND neighbours in a row of sums of columns, reflected beyond it."""
    reach = AROUND // 2
    for place in range(reach):
        sums[place] = sums[reach + _reflected(place - reach, columns)]
        behind = reach + columns + place
        sums[behind] = sums[reach + _reflected(columns + place, columns)]
    for column in range(columns):
        total = np.int32(0)
        for place in range(AROUND):
            total += sums[column + place]
        line[column] = total


@kernel(allocates=True)
def write_out(fitted, validity, certain, limits, bounds, disparity, confidence, first, last):
    """
    Write disparities in pixels and their confidence.

    A disparity that few neighbours found has less confidence: the surface ends there.

    fitted: `fine` and `agreeing` of smooth_offsets; certain: uint16 (R, C), which counts as the
    mean of AROUND x AROUND pixels, reflected beyond the image; limits: uint8 (R, C), of the
    confidence, in 1 / 255; bounds: lowest and highest disparity, px, and the confidence below
    which pixels are NaN, all float32; disparity, confidence: float32 (R, C), written.
    What is not consistent, points outside of the target, or has no certain pixel around, has
    confidence 0.
    """
    (fine, agreeing), (lowest, highest, threshold) = fitted, bounds
    # columns of the target that exist: those of the image, moved by the lowest disparity
    first_column, width = np.int32(STEPS * lowest - STEPS // 2), np.int32(STEPS * certain.shape[1])
    columns, reach = certain.shape[1], AROUND // 2
    shares, of_area = np.empty(columns + LANES, np.float32), np.empty(columns, np.int32)
    sums = np.zeros(columns + 2 * reach, np.int32)
    for row in range(first - reach, first + reach):
        _add_row(certain, row, 1, sums)
    for row in range(first, last):
        _add_row(certain, row + reach, 1, sums)
        _sum_line(sums, columns, of_area)
        _add_row(certain, row - reach, -1, sums)
        agree, share, limit, found = agreeing[row], confidence[row], limits[row], fine[row]
        valid, pixels = validity[row], disparity[row]
        for column in range(share.size):    # one loop would have more arrays than LLVM compares
            pointed = np.int32(STEPS * np.int32(column) - first_column - np.int32(found[column]))
            enough = ((valid[column] == CONSISTENT) & (of_area[column] > 0)
                      & (limit[column] > 0) & (pointed >= 0) & (pointed < width))
            score = np.float32(of_area[column]) * np.float32(agree[column])
            shares[column] = score + np.float32(NEVER) * (np.float32(1) - np.float32(enough))
        for column in range(0, share.size, LANES):
            score, least = load(shares, column), splat(np.float32(1))
            for line in range(len(LINES)):
                least = least_float(least, add_floats(
                    splat(LINES[line, 0]), multiply_floats(splat(LINES[line, 1]), score)))
            store(shares, column, least)
        for column in range(share.size):
            sure = min(np.float32(limit[column]) * np.float32(1 / 255), shares[column])
            share[column] = max(sure, np.float32(0))
            value = np.float32(found[column]) * np.float32(1 / STEPS) + lowest
            value = min(max(value, lowest), highest)
            pixels[column] = value if sure >= threshold else np.float32(np.nan)
