# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Possibilities of single matches by fuzzy classes, and their means over the uniform cells around.

Classes are of grey levels, and of gradients as well; cells around are along rows and columns.
"""
from fuzzy_stereo_ros.matching.kernels import simd
from fuzzy_stereo_ros.matching.kernels.compiled import called, kernel
from fuzzy_stereo_ros.matching.kernels.rows import copy_row
import numpy as np

WHOLE_BITS = 8
WHOLE = 2**WHOLE_BITS       # sum of the weights of an average
REACH = 8                   # disparities that an average reaches up and down at the most
OUTSIDE_POSSIBILITY = 40    # 255ths, of a match outside the target: about that of a poor match


@kernel
def fill_class_possibility(tables, levels, min_disparity, disparities, first, last, possibility):
    """
    Write how possible each match of some rows is by grey AND by both gradients: their product.

    tables: uint8 (3, 256, 256), 255ths, of grey, of the gradient across and of that down; levels:
    uint8 (3, R, C), those of the tables, of the reference and of the target; possibility: uint8
    (R, C, at least disparities), 255ths
    """
    (reference, target), columns = levels, possibility.shape[1]
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
                    here[index] = OUTSIDE_POSSIBILITY


@kernel(allocates=True)
def average_over_uniform(possibility, colours, weights, slopes, disparities, along_columns, first,
                         last, average):
    """
    Write the mean possibility over the uniform cells along one direction through each cell.

    The cells lie on a line that rises by the slope at the middle, in whole disparities.

    A cell weighs by its nearness AND by its membership in the class of the colour at the middle:
    Eq. 1 about that colour. Weights are rounded to 1 / WHOLE, and the middle takes what that
    leaves over: sums of LANES disparities at once then fit 16 bits.

    possibility: uint8 (R, C, max(D, LANES) + REACH), 255ths; what is beyond D, and REACH bytes
    before the array, is that outside the range; weights: float32 (half + 1, n), by distance in
    cells and by squared distance of colours / 4, the last for all beyond; slopes: float32 (R, C),
    disparities a cell, at most REACH / half; along_columns: or along rows; average: as possibility
    """
    rows, columns, depth = possibility.shape
    half = weights.shape[0] - 1
    stride = depth * (columns if along_columns else 1)
    within = simd.less(simd.lane_numbers(simd.splat(np.uint8(0))),
                       simd.splat(np.uint8(min(disparities, simd.LANES))))
    beyond = simd.splat(np.uint8(OUTSIDE_POSSIBILITY))
    flat, flat_average = possibility.reshape(-1), average.reshape(-1)
    degrees = np.zeros((2 * half + 1, columns), np.float32)
    parts, whole = np.zeros(degrees.shape, np.uint16), np.zeros(columns, np.float32)
    distances, places = np.zeros(columns, np.int32), np.zeros(2 * half + 1, np.int64)
    for row in range(first, last):
        whole[:] = 0
        for tap in range(2 * half + 1):
            down, across = (tap - half, 0) if along_columns else (0, tap - half)
            begin, end = max(-across, 0), min(columns - across, columns)
            degrees[tap] = 0
            if 0 <= row + down < rows and begin < end:
                distances[:] = 0
                for channel in range(3):    # slices of one axis: the compiler uses vectors
                    _add_squares(
                        colours[channel, row + 1, 1 + begin:1 + end],
                        colours[channel, row + down + 1, 1 + begin + across:1 + end + across],
                        distances)
                _add_degrees(distances, weights[abs(tap - half)], degrees[tap, begin:end],
                             whole[begin:end])
        _cut_into_parts(degrees, whole, parts)
        for column in range(columns):
            place, size = (row, rows) if along_columns else (column, columns)
            taps = range(max(half - place, 0), min(half + size - place, 2 * half + 1))
            middle, slope = (row * columns + column) * depth, slopes[row, column]
            for tap in taps:
                rise = np.floor(slope * np.float32(tap - half) + np.float32(0.5))
                places[tap] = middle + (tap - half) * stride + np.int64(rise)
            for block in range(0, disparities, simd.LANES):
                begin = min(block, max(disparities - simd.LANES, 0))
                total = simd.splat(np.uint16(WHOLE // 2))
                for tap in taps:
                    total = simd.add(total, simd.multiply(
                        simd.splat(parts[tap, column]),
                        simd.widen(simd.load(flat, places[tap] + begin))))
                simd.store(flat_average, middle + begin, simd.choose(
                    within, simd.narrow(simd.shift_right(total, WHOLE_BITS)), beyond))


@called
def _add_squares(here, there, distances):
    """Add the squares of the differences of two rows of bytes."""
    for column in range(len(here)):
        step = np.int32(here[column]) - np.int32(there[column])
        distances[column] += np.int32(step * step)


@called
def _add_degrees(distances, weights, degrees, whole):
    """Write the weights of cells at squared distances of colours, and add them to a sum."""
    last = np.int32(weights.size - 1)
    for column in range(len(degrees)):
        weight = weights[np.uint32(min(distances[column] >> np.int32(2), last))]
        degrees[column] = weight
        whole[column] += weight


@called
def _cut_into_parts(degrees, whole, parts):
    """Write weights, float32 (n, C), of a sum (C,), as whole parts of WHOLE: uint16 (n, C)."""
    middle = parts[len(parts) // 2]
    for column in range(len(whole)):
        whole[column] = np.float32(WHOLE) / whole[column]
        middle[column] = WHOLE
    for tap in range(len(parts)):
        if tap != len(parts) // 2:
            line, scaled = parts[tap], degrees[tap]
            for column in range(len(whole)):
                part = np.uint16(np.int32(scaled[column] * whole[column] + np.float32(0.5)))
                line[column] = part
                middle[column] -= part


@kernel
def fill_planes(possibility, table, first, last, planes):
    """
    Write possibilities with one framed plane a disparity, each by a table, uint8 (256,).

    possibility: uint8 (R, C, at least D); planes: written at [k, r + 1, c + 1]
    """
    columns, disparities = possibility.shape[1], planes.shape[0]
    for row in range(first, last):
        for index in range(disparities):
            plane = planes[index, row + 1]
            for column in range(columns):
                plane[column + 1] = table[possibility[row, column, index]]


@kernel
def most_possible(planes, best, chromosome):
    """Write the most possible disparity of each cell; of equals the smallest; best: memory."""
    for row in range(1, planes.shape[1] - 1):
        copy_row(planes[0, row], best)
        chromosome[row] = 0
        for index in range(1, planes.shape[0]):
            plane = planes[index, row]
            for column in range(best.size):
                if plane[column] > best[column]:
                    best[column] = plane[column]
                    chromosome[row, column] = index


@kernel
def fill_largest_elsewhere(planes, chromosome, near, first, last, largest):
    """Write the possibility of the best match that is farther than `near` from a chromosome's."""
    width = chromosome.shape[1]
    flat, flat_genes, flat_largest = planes.reshape(-1), chromosome.reshape(-1), largest.reshape(
        -1)
    plane, reach = chromosome.size, simd.splat(np.uint16(2 * near))
    for row in range(first + 1, last + 1):
        for column in range(0, width, simd.LANES):
            start = row * width + min(column, width - simd.LANES)
            # genes less `near`: what is at most 2 * near above them is near
            least = simd.subtract(simd.load(flat_genes, start), simd.splat(np.uint16(near)))
            best = simd.splat(np.uint8(0))
            for index in range(planes.shape[0]):
                away = simd.subtract(simd.splat(np.uint16(index)), least)
                far = simd.narrow(simd.less(reach, away))
                best = simd.maximum(best, simd.bit_and(
                    far, simd.load(flat, index * plane + start)))
            simd.store(flat_largest, start, best)
