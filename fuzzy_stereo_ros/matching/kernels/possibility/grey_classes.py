# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Possibilities of single matches by fuzzy classes: of grey levels, and of gradients as well."""
from fuzzy_stereo_ros.matching.kernels.compiled import kernel
import numpy as np


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
def fill_class_possibility(tables, reference, target, min_disparity, disparities, outside, first,
                           last, possibility):
    """
    Write how possible each match of some rows is by grey AND by both gradients: their product.

    tables: uint8 (3, 256, 256), 255ths, of grey, of the gradient across and of that down
    reference, target: uint8 (3, R, C), the levels of the tables; outside: uint8, 255ths, of a
    match outside the target; first, last: rows
    possibility: uint8 (R, C, at least disparities), 255ths, written
    """
    columns = possibility.shape[1]
    for row in range(first, last):
        grey, across, down = target[0, row], target[1, row], target[2, row]
        for column in range(columns):
            of_grey = tables[0, reference[0, row, column]]
            of_across = tables[1, reference[1, row, column]]
            of_down = tables[2, reference[2, row, column]]
            here = possibility[row, column]
            nearest = column - min_disparity
            for index in range(disparities):
                seen = nearest - index
                if 0 <= seen < columns:
                    product = np.int64(of_grey[grey[seen]]) * np.int64(
                        of_across[across[seen]]) * np.int64(of_down[down[seen]])
                    here[index] = np.uint8((product + 32512) // 65025)
                else:
                    here[index] = outside


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
