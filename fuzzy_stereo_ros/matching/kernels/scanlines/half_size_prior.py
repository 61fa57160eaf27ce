# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The prior of the full search, from the half-size map."""
from fuzzy_stereo_ros.matching.kernels.compiled import kernel
from fuzzy_stereo_ros.matching.kernels.possibility.costs import weight_of
from fuzzy_stereo_ros.matching.kernels.rows import copy_row
from fuzzy_stereo_ros.matching.kernels.units import INVALID, STEPS
import numpy as np

WEAK = weight_of(1, 2)  # of the prior where texture is weak: the largest cost is reached at 3 px
CLEAR = 4               # least margin, in summed cost, of a label of the prior


@kernel
def texture_steps(grey, steps, first, last):
    """
    Write the steps of grey along the rows of an image at half size.

    grey: uint8 (R, C + slack) at full size; steps: uint16 (r, c), of three pixels of a full row
    """
    columns = steps.shape[1]
    for row in range(first, last):
        for column in range(columns - 1):
            here = np.int16(grey[2 * row, 2 * column + 1])
            steps[row, column] = (abs(here - np.int16(grey[2 * row, 2 * column]))
                                  + abs(np.int16(grey[2 * row, 2 * column + 2]) - here))
        steps[row, columns - 1] = steps[row, max(columns - 2, 0)]


@kernel(allocates=True)
def weak_texture(steps, limit, weak, first, last):
    """
    Mark the half-size pixels around which the full image has little texture.

    steps: of texture_steps; weak: uint8 (r, c), 1 where the steps along the row of 6 x 3 pixels
    sum to less than `limit`.
    """
    rows, columns = steps.shape
    total = np.empty(columns + 2, np.uint16)
    left, middle, right = total[:-2], total[1:-1], total[2:]
    for row in range(first, last):
        above, here, below = steps[max(row - 1, 0)], steps[row], steps[min(row + 1, rows - 1)]
        for column in range(columns):
            middle[column] = above[column] + here[column] + below[column]
        total[0], total[columns + 1] = total[1], total[columns]
        line = weak[row]
        for column in range(columns):
            line[column] = np.int32(left[column]) + middle[column] + right[column] < limit


@kernel(allocates=True)
def flat(labels, most, smooth, first, last):
    """Mark the pixels whose 3 x 3 labels differ by at most `most`: uint8 (r, c)."""
    rows, columns = labels.shape
    low, high = np.empty(columns + 2, labels.dtype), np.empty(columns + 2, labels.dtype)
    for row in range(first, last):
        above, here, below = labels[max(row - 1, 0)], labels[row], labels[min(row + 1, rows - 1)]
        for column in range(columns):
            low[column + 1] = min(above[column], here[column], below[column])
            high[column + 1] = max(above[column], here[column], below[column])
        low[0], low[columns + 1] = low[1], low[columns]
        high[0], high[columns + 1] = high[1], high[columns]
        left_low, right_low, left_high, right_high = low[:-2], low[2:], high[:-2], high[2:]
        middle_low, middle_high, line = low[1:-1], high[1:-1], smooth[row]
        for column in range(columns):
            least = min(left_low[column], middle_low[column], right_low[column])
            largest = max(left_high[column], middle_high[column], right_high[column])
            line[column] = largest - least <= most


@kernel(allocates=True)
def half_prior(half, found, weak, smooth, prior, first, last):
    """
    Spread the half map, doubled, as a prior: of a weight where it can be relied on, else 0.

    A label that the median has not changed is doubled with its sub-pixel offset. Labels found with
    a margin below CLEAR are left out: a prior without evidence would look like evidence.

    half, weak, smooth: (r, c); found: (r, c) each, labels, offsets and margins of the search, and
    the validity of its labels; prior: labels and weights, (R, C), R in (2 r, 2 r + 1); first,
    last: rows of the half map.
    """
    labels, weights = prior
    rows, columns = half.shape
    first_labels, offsets, margins, validity = found
    doubled, weight = np.zeros(columns, np.int32), np.zeros(columns, np.uint8)
    for row in range(first, last):
        for column in range(columns):
            label, offset = half[row, column], offsets[row, column]
            further = np.int32(offset > STEPS // 4) - np.int32(offset < -STEPS // 4)
            doubled[column] = 2 * np.int32(label) + further * (label == first_labels[row, column])
        for column in range(columns):   # apart: LLVM compares few arrays in a loop
            weight[column] = WEAK * (weak[row, column] & smooth[row, column]
                                     & (validity[row, column] != INVALID)
                                     & (margins[row, column] >= CLEAR))
        line, weight_line = labels[2 * row], weights[2 * row]
        for column in range(columns):
            line[2 * column] = line[2 * column + 1] = doubled[column]
            weight_line[2 * column] = weight_line[2 * column + 1] = weight[column]
        line[2 * columns:] = doubled[columns - 1]
        weight_line[2 * columns:] = weight[columns - 1]
        end = labels.shape[0] if row == rows - 1 else 2 * row + 2
        for below in range(2 * row + 1, end):
            copy_row(line, labels[below])
            copy_row(weight_line, weights[below])
