# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Possibilities of the grey classes: of every match, and of the matches a chromosome chose."""

from fuzzy_stereo_ros.matching.kernels.compiled import kernel


@kernel
def fill_grey_possibility(table, reference, target, min_disparity, possibility):
    """
    Write how possible the match of (r, c) is at each disparity: Eq. 2, read from a table.

    Here the reference is the left image: pixel (r, c) meets (r, c - min_disparity - k) in the
    target. The paper's reference is the right image, with (r, c + d) in the target: that is
    the same after both images were mirrored left to right and exchanged, which is done above.
    A match outside the target image is not possible: 0.

    table: uint8 (256, 256), 255ths; reference, target: uint8 (R, C), grey levels
    possibility: uint8 (R, C, D), 255ths, written
    """
    rows, columns, disparities = possibility.shape
    for row in range(rows):
        for column in range(columns):
            of_level = table[reference[row, column]]
            nearest = column - min_disparity
            for index in range(disparities):
                seen = nearest - index
                if 0 <= seen < columns:
                    possibility[row, column, index] = of_level[target[row, seen]]
                else:
                    possibility[row, column, index] = 0


@kernel
def fill_chosen_possibility(possibility, chromosome, chosen):
    """
    Write how possible the match is that a chromosome chose at each cell.

    possibility: uint8 (R, C, D), 255ths; chromosome: uint16 (R, C), index of a disparity
    chosen: uint8 (R, C), 255ths, written
    """
    rows, columns = chromosome.shape
    for row in range(rows):
        for column in range(columns):
            chosen[row, column] = possibility[row, column, chromosome[row, column]]
