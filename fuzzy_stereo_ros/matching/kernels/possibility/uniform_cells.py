# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Means of possibilities over the uniform cells around each cell, along rows and columns."""
from fuzzy_stereo_ros.matching.kernels import simd
from fuzzy_stereo_ros.matching.kernels.compiled import inlined, kernel
import numpy as np


@inlined
def _squared(first, second):
    step = np.int32(first) - np.int32(second)
    return np.int32(step * step)


@kernel
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
        best[:] = planes[0, row]
        chromosome[row] = 0
        for index in range(1, planes.shape[0]):
            plane = planes[index, row]
            for column in range(best.size):
                if plane[column] > best[column]:
                    best[column] = plane[column]
                    chromosome[row, column] = index
