# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Evidence of plain regions for disparities: faint texture of both views, correlated and summed.

A pixel of a plain wall says nothing, all of them together do. Pictures are measured on every other
row. Their texture is split into two bands by differences of binomial means inside the mask of what
is plain, so that edges around do not ring into it. The products of both views are summed in cells
of 8 of these rows and 16 columns, for every disparity.
"""
from fuzzy_stereo_ros.matching.kernels.compiled import inlined, kernel
from fuzzy_stereo_ros.matching.kernels.possibility.features import MARGIN
from fuzzy_stereo_ros.matching.kernels.refinement.consistency import root
from fuzzy_stereo_ros.matching.kernels.simd import (
    add, bit_and, bit_xor, equal_bits, high_product, LANES, less, load, minimum, multiply,
    shift_left, shift_right, splat, store, subtract, total)
import numpy as np

PAD = 4              # columns around a picture, as far as the widest mean reaches
BANDS = 2            # of texture: 1 to 2 px and 2 to 4 px
LARGEST = 11         # of a quantised band: the sums of a cell stay below 2**15
ROWS, COLUMNS = 8, 16    # rows (of the picture: every other one) and columns of a cell
COUNTED = 4          # one row in so many is counted
PLAIN = 2**16 - 1    # of a mask at full width


@kernel(allocates=True)
def flatness(luminance, columns, burnt, steps, first, last):
    """
    Write the largest step of a smoothed half-size picture in any direction, 1/64 grey level a px.

    luminance: uint16, with a margin; burnt: luminance from which a pixel is burnt out, whose step
    is the largest; steps: uint16 (r, c)
    """
    wide = columns + 2 * MARGIN
    smooth, slope = np.empty(wide, np.int32), np.empty(wide, np.int32)
    for row in range(first, last):
        a, b, c, d, e = (luminance[row], luminance[row + 1], luminance[row + 2],
                         luminance[row + 3], luminance[row + 4])
        for column in range(wide):
            outer, inner = np.int32(a[column]), np.int32(b[column])
            inner_below, outer_below = np.int32(d[column]), np.int32(e[column])
            smooth[column] = (outer + outer_below + 4 * (inner + inner_below)
                              + 6 * np.int32(c[column]))
            slope[column] = outer_below - outer + 2 * (inner_below - inner)
        for column in range(columns):
            across = (smooth[column + 4] - smooth[column]
                      + 2 * (smooth[column + 3] - smooth[column + 1]))
            down = (slope[column] + slope[column + 4] + 4 * (slope[column + 1] + slope[column + 3])
                    + 6 * slope[column + 2])
            step = min(max(abs(across), abs(down)) >> 9, 65535)
            steps[row, column] = 65535 if c[column + MARGIN] >= burnt else step


@kernel(allocates=True)
def plain_mask(steps, limit, mask, first, last):
    """Mark the half-size pixels all of whose 3 x 3 pixels have steps below a limit: uint8."""
    rows, columns = steps.shape
    near = np.ones(columns + 2, np.uint8)
    left, middle, right = near[:-2], near[1:-1], near[2:]
    for row in range(first, last):
        above, here, below = steps[max(row - 1, 0)], steps[row], steps[min(row + 1, rows - 1)]
        for column in range(columns):
            middle[column] = max(above[column], here[column], below[column]) < limit
        line = mask[row]
        for column in range(columns):
            line[column] = left[column] & middle[column] & right[column]


@kernel
def mask_regions(mask, begin, end, parent, row_runs):
    """
    Write the runs of a mask, and join those that touch the row above.

    mask: uint8 (r, c); begin, end, parent, row_runs: as of segments.find_runs
    """
    known = np.int64(0)
    above = np.int64(0)
    for row in range(mask.shape[0]):
        line, column, columns = mask[row], np.int64(0), mask.shape[1]
        row_runs[row, 0] = known
        upper, stop = above, known
        above = known
        while column < columns:
            while column < columns and not line[np.uint64(column)]:
                column += 1
            if column == columns:
                break
            begin[known] = column
            while column < columns and line[np.uint64(column)]:
                column += 1
            end[known], parent[known] = column, known
            while upper < stop and end[upper] <= begin[known]:
                upper += 1
            touching = upper
            while touching < stop and begin[touching] < column:
                one, other = root(parent, known), root(parent, touching)
                parent[max(one, other)] = min(one, other)
                touching += 1
            known += 1
        row_runs[row, 1] = known


@kernel
def widen_mask(mask, offset, inside, wide, first, last):
    """
    Spread a half-size mask over full columns from `offset` on, where they are inside.

    mask: uint8 (r, c); inside: first and last column; wide: uint16 (r, ...), PLAIN or 0
    """
    begin = (max(inside[0] - offset, 0) + 1) // 2
    end = max(min(mask.shape[1], (inside[1] - offset + 1) // 2), begin)
    for row in range(first, last):
        line, target = mask[row, begin:end], wide[row, 2 * begin + offset + PAD:]
        for column in range(len(line)):
            flag = np.uint16(PLAIN) * line[column]
            target[2 * column] = flag
            target[2 * column + 1] = flag


@inlined
def _none(flags):
    """Return whether no lane of a mask is set."""
    return equal_bits(flags, splat(np.uint16(0))) == np.uint32(0xFFFFFFFF)


@kernel
def every_other_row(luminance, mask, columns, picture, first, last):
    """
    Write the binomial mean of 3 x 3 pixels in every other row, a quarter, near those of a mask.

    luminance: uint16 (R, ...), with a margin; mask: uint16 (r, ...), PLAIN or 0; picture: uint16
    (r, ...)
    """
    source, target, flags = luminance.reshape(-1), picture.reshape(-1), mask.reshape(-1)
    stride = luminance.shape[1]
    for row in range(first, last):
        for column in range(0, columns, LANES):
            if _none(load(flags, row * mask.shape[1] + column + PAD)):
                continue
            sums = splat(np.uint16(2))
            for line in range(3):
                place = (2 * row + MARGIN - 1 + line) * stride + column + MARGIN
                across = shift_right(add(
                    add(shift_right(load(source, place - 1), 2),
                        shift_right(load(source, place + 1), 2)),
                    shift_left(shift_right(load(source, place), 2), 1)), 2)
                sums = add(sums, shift_left(across, line & 1))
            store(target, row * picture.shape[1] + column + PAD, shift_right(sums, 2))


@kernel
def mean_of_three(picture, mask, columns, apart, result, first, last):
    """
    Write the binomial mean of each pixel and those `apart` elements before and after it.

    Others than those of the mask count as the pixel itself. picture, result: uint16 (r, ...);
    mask: uint16 (r, ...), PLAIN or 0; apart: columns, or rows times the stride; first, last: rows
    """
    source, flags, target = picture.reshape(-1), mask.reshape(-1), result.reshape(-1)
    stride, wide = picture.shape[1], mask.shape[1]
    down, right = apart // stride, apart % stride
    for row in range(first, last):
        before = 0 if row < down else -1
        after = 0 if row + down >= picture.shape[0] else 1
        for column in range(PAD, columns + PAD, LANES):
            place, flag = row * stride + column, row * wide + column
            if _none(load(flags, flag)):
                continue
            here = load(source, place)
            sums = add(splat(np.uint16(2)), shift_left(here, 2))
            for side in (before, after):
                if side != 0:
                    other = subtract(load(source, place + side * apart), here)
                    sums = add(sums, bit_and(
                        other, load(flags, flag + side * (down * wide + right))))
            store(target, place, shift_right(sums, 2))


@kernel
def subtract_means(fine, coarse, mask, columns, band, sums, first, last):
    """
    Write the difference of two means inside a mask: int16; add its size and count to `sums`.

    fine, coarse: uint16 (r, ...); mask: uint16, PLAIN or 0; band: int16, as wide as the mask
    """
    one, other, flags = fine.reshape(-1), coarse.reshape(-1), mask.reshape(-1)
    target = band.view(np.uint16).reshape(-1)
    size = number = 0
    for row in range(first, last):
        for column in range(PAD, columns + PAD, LANES):
            place, flag = row * fine.shape[1] + column, row * mask.shape[1] + column
            plain = load(flags, flag)
            if _none(plain):
                store(target, flag, plain)
                continue
            difference = bit_and(subtract(load(one, place), load(other, place)), plain)
            store(target, flag, difference)
            size += total(minimum(difference, subtract(splat(np.uint16(0)), difference)))
            number += total(shift_right(plain, 15))
    sums[0] += size
    sums[1] += number


@kernel
def quantise(band, mask, columns, clip, first, last):
    """
    Scale a band so that `clip` and what is beyond become LARGEST; return the sum of squares.

    band: int16, mask: uint16, PLAIN or 0: (r, ...); clip: above LARGEST
    """
    values, flags = band.view(np.uint16).reshape(-1), mask.reshape(-1)
    scale, power = splat(np.uint16(2 * LARGEST * 2**15 // clip)), 0
    for row in range(first, last):
        for place in range(row * band.shape[1] + PAD, row * band.shape[1] + PAD + columns, LANES):
            if _none(load(flags, place)):
                continue
            value = load(values, place)
            negative = less(splat(np.uint16(2**15 - 1)), value)
            size = subtract(bit_xor(value, negative), negative)
            size = minimum(shift_left(size, 1), splat(np.uint16(PLAIN)))
            size = shift_right(add(high_product(size, scale), splat(np.uint16(1))), 1)
            size = minimum(size, splat(np.uint16(LARGEST)))
            power += total(multiply(size, size))
            store(values, place, subtract(bit_xor(size, negative), negative))
    return power


@kernel
def list_cells(begin, end, row_runs, region, places, starts):
    """
    Count the cells that each region reaches into, and number them, region by region.

    begin to region: see segments.number_regions; places: int32 (regions, cell rows, cell columns),
    the number of each cell, -1 where the region is not; starts: int32 (regions + 1,)
    """
    places[:] = -1
    for row in range(len(row_runs)):
        for run in range(row_runs[row, 0], row_runs[row, 1]):
            if region[run] >= 0:
                for cell in range(2 * begin[run] // COLUMNS, (2 * end[run] - 1) // COLUMNS + 1):
                    places[region[run], row // ROWS, cell] = 0
    number = 0
    for mine in range(places.shape[0]):
        starts[mine] = number
        for row in range(places.shape[1]):
            for column in range(places.shape[2]):
                if places[mine, row, column] == 0:
                    places[mine, row, column] = number
                    number += 1
    starts[places.shape[0]] = number
    return number


@kernel
def vote(left, right, seen, begin, end, row_runs, region, places, half_labels, base, curves,
         counts, cells, first, last):
    """
    Sum the products of the bands of regions with those of all candidates, cell by cell.

    left, right: int16 (BANDS, r, ...), padded, the right one mirrored; seen: uint16, its mask;
    places: of list_cells; half_labels: (r, c), the map at half size; base: index of the candidate
    of column 0 for label 0; curves: int16 (cells, BANDS, labels), counts: int16 (cells, labels),
    of candidates that are seen, in one of COUNTED rows; cells: int32 (cells, 4 + BANDS): pixels of
    half size, sums of their columns, rows and labels, and the power of each band; first, last: the
    rows of whole cells
    """
    labels = curves.shape[2]
    sums, numbers = curves.view(np.uint16).reshape(-1), counts.view(np.uint16).reshape(-1)
    source, flags = right.view(np.uint16).reshape(-1), seen.reshape(-1)
    rows, stride = right.shape[1:]
    for row in range(first, last):
        for run in range(row_runs[row, 0], row_runs[row, 1]):
            if region[run] < 0:
                continue
            half = np.int64(begin[run])
            while half < end[run]:
                stop = min(np.int64(end[run]), (half // (COLUMNS // 2) + 1) * (COLUMNS // 2))
                place = np.int64(places[region[run], row // ROWS, half // (COLUMNS // 2)])
                cell = cells[place]
                for pixel in range(half, stop):
                    cell[0] += 1
                    cell[1] += pixel
                    cell[2] += row
                    cell[3] += half_labels[row, pixel]
                for band in range(BANDS):
                    line = left[band, row, PAD:]
                    for column in range(2 * half, 2 * stop):
                        cell[4 + band] += line[column] * line[column]
                    for block in range(0, labels, LANES):
                        target = (place * BANDS + band) * labels + block
                        products = load(sums, target)
                        candidate = (band * rows + row) * stride + base + PAD + block
                        for column in range(2 * half, 2 * stop):
                            products = add(products, multiply(
                                splat(np.uint16(line[column])), load(source, candidate - column)))
                        store(sums, target, products)
                if row % COUNTED == 0:
                    for block in range(0, labels, LANES):
                        target, number = place * labels + block, row * stride + base + PAD + block
                        known = load(numbers, target)
                        for column in range(2 * half, 2 * stop):
                            known = subtract(known, load(flags, number - column))
                        store(numbers, target, known)
                half = stop


@kernel
def write_planes(begin, end, row_runs, region, places, kept, planes, half_disparities, half_labels,
                 disparities, labels, weights, weight, first, last):
    """
    Write planes into a half-size map and into the prior of the full search, in the cells kept.

    kept: uint8, by cell; planes: float64 (regions, 3), of half-size x and y and full disparity;
    half_labels: (r, c); labels, weights: (R, C), of the prior; first, last: half-size rows
    """
    half_highest, highest = np.int64(half_disparities - 1), np.int64(disparities - 1)
    for row in range(first, last):
        for run in range(row_runs[row, 0], row_runs[row, 1]):
            if region[run] < 0 or np.isnan(planes[region[run], 0]):
                continue
            slope, fall, offset = planes[region[run]]
            half = np.int64(begin[run])
            while half < end[run]:
                stop = min(np.int64(end[run]), (half // (COLUMNS // 2) + 1) * (COLUMNS // 2))
                if kept[places[region[run], row // ROWS, half // (COLUMNS // 2)]]:
                    step = np.int64(slope * 2**15)      # a full pixel, in 1 / 2**16
                    for lower in range(2):
                        label = np.int64(2**16 * (
                            slope * (half - 0.25) + fall * (row + 0.5 * lower - 0.25) + offset
                            + 0.5))
                        line, flags = labels[2 * row + lower], weights[2 * row + lower]
                        for column in range(2 * half, 2 * stop):
                            line[column] = min(max(label >> 16, 0), highest)
                            flags[column] = weight
                            label += step
                    label = np.int64(2**15 * (slope * half + fall * row + offset + 1))
                    for column in range(half, stop):
                        half_labels[row, column] = min(max(label >> 16, 0), half_highest)
                        label += step
                half = stop
