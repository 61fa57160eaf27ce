# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Possibilities of single matches by fuzzy classes, and their means over the uniform cells around.

Classes are of grey levels, and of gradients as well; cells around are along rows and columns.
"""
from fuzzy_stereo_ros.matching.kernels import simd
from fuzzy_stereo_ros.matching.kernels.compiled import inlined, kernel
from fuzzy_stereo_ros.matching.kernels.possibility.features import copy_row
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


@inlined
def _squared(first, second):
    step = np.int32(first) - np.int32(second)
    return np.int32(step * step)


@kernel(allocates=True)
def average_over_uniform(possibility, colours, similar, near, along_columns, first, last,
                         average):
    """
    Write the mean possibility over the uniform cells along one direction through each cell.

    A cell weighs by its nearness AND by its membership in the class of the colour at the middle:
    Eq. 1 about that colour.

    possibility: uint8 (R, C, D), 255ths, D a multiple of simd.FLOATS; colours: uint8 (R, C, 3)
    along_columns: or along rows; near: float32 (half + 1,), by distance; similar: float32, by
    squared distance of colours / 4, none beyond its end; first, last: rows
    average: uint8 (R, C, D), 255ths, written
    """
    rows, columns, disparities = possibility.shape
    half, stride = near.size - 1, columns if along_columns else 1
    flat_possibility, flat_colours = possibility.reshape(-1), colours.reshape(-1)
    flat_average = average.reshape(-1)
    weights, starts = np.zeros(2 * half + 1, np.float32), np.zeros(2 * half + 1, np.int64)
    for row in range(first, last):
        for column in range(columns):
            place, size = (row, rows) if along_columns else (column, columns)
            cell = row * columns + column
            blue, green, red = (flat_colours[3 * cell], flat_colours[3 * cell + 1],
                                flat_colours[3 * cell + 2])
            whole, number = np.float32(0), np.uint64(0)
            for step in range(-min(half, place), min(half, size - 1 - place) + 1):
                other = np.uint64(cell + step * stride)
                colour = np.uint64(3) * other
                distance = np.uint64(
                    _squared(blue, flat_colours[colour])
                    + _squared(green, flat_colours[colour + np.uint64(1)])
                    + _squared(red, flat_colours[colour + np.uint64(2)])) >> np.uint64(2)
                if distance < np.uint64(similar.size):
                    weight = similar[distance] * near[np.uint64(abs(step))]
                    whole += weight
                    weights[number] = weight
                    starts[number] = np.int64(other) * disparities
                    number += np.uint64(1)
            for block in range(0, disparities, simd.FLOATS):
                total = simd.no_floats()
                for index in range(number):
                    total = simd.add_weighted(total, flat_possibility, starts[index] + block,
                                              weights[index])
                simd.store_rounded(flat_average, cell * disparities + block, total,
                                   np.float32(1) / whole)


@kernel
def fill_planes(possibility, table, first, last, planes):
    """
    Write possibilities with one framed plane a disparity, each by a table.

    possibility: uint8 (R, C, at least D); table: uint8 (256,); first, last: rows
    planes: uint8 (D, R + 2, W), written at [k, r + 1, c + 1]
    """
    columns, disparities = possibility.shape[1], planes.shape[0]
    for row in range(first, last):
        for index in range(disparities):
            plane = planes[index, row + 1]
            for column in range(columns):
                plane[column + 1] = table[possibility[row, column, index]]


@kernel
def most_possible(planes, first, last, best, chromosome):
    """
    Write the most possible disparity of each cell; of equals the smallest.

    planes: uint8 (D, R + 2, W); first, last: rows; best: uint8 (W,), memory
    chromosome: uint16 (R + 2, W), framed, index of a disparity, written
    """
    for row in range(first + 1, last + 1):
        copy_row(planes[0, row], best)
        chromosome[row] = 0
        for index in range(1, planes.shape[0]):
            plane = planes[index, row]
            for column in range(best.size):
                if plane[column] > best[column]:
                    best[column] = plane[column]
                    chromosome[row, column] = index
