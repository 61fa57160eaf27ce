# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Evidence of plain regions for disparities: faint texture of both views, correlated and summed.

One pixel of a plain wall does not determine its disparity; all of its pixels together do. Pictures
are measured on every other row. Their texture is split into two bands by differences of binomial
means inside the mask of plain pixels, so that edges outside the mask add nothing. The products of
both views are summed in cells of 8 of these rows and 16 columns, for every disparity.
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
LARGEST = 11         # value of a quantised band: the sums of a cell stay below 2**15
ROWS, COLUMNS = 8, 16    # rows (of the picture: every other one) and columns of a cell
COUNTED = 4          # every COUNTED-th row is counted
PLAIN = 2**16 - 1    # value of a set pixel in a mask at full width
REACH = 3            # rows that the means of a row reach over, above and below
NONE = np.uint32(0xFFFFFFFF)     # the bits of lanes equal to 0 where no lane of a mask is set
RING = 8             # rows, at least 2 * REACH + 1


@kernel(allocates=True)
def plain_mask(luminance, columns, burnt, limit, mask, ends, first, last):
    """
    Mark the half-size pixels all of whose 3 x 3 pixels have small steps and are not burnt out.

    A step is that of the smoothed picture in the direction of the largest, 1/64 grey level a px.
    luminance: uint16, with a margin; burnt: luminance from which a pixel is burnt out; limit: of
    steps; mask: uint8 (r, c + LANES); ends: int32 (r, 2), where in a row the first of the blocks
    of LANES columns with a marked pixel begins, and where the last one ends; first, last: rows
    """
    wide = columns + 2 * MARGIN
    smooth, slope = np.empty(wide, np.int32), np.empty(wide, np.int32)
    steps, flat = np.empty(columns, np.uint16), np.ones((3, columns + 2), np.uint8)
    for row in range(first - 1, last + 1):
        flags = flat[row % 3, 1:]
        if row < 0 or row >= len(mask):
            flags[:columns] = 1
        else:
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
                down = (slope[column] + slope[column + 4] + 6 * slope[column + 2]
                        + 4 * (slope[column + 1] + slope[column + 3]))
                step = min(max(abs(across), abs(down)) >> 9, 65535)
                steps[column] = 65535 if c[column + MARGIN] >= burnt else step
            for column in range(columns):
                flags[column] = steps[column] < limit
        if row > first:
            _mark_row(flat[0], flat[1], flat[2], mask, row - 1, columns, ends)


@inlined
def _mark_row(one, two, three, mask, row, columns, ends):
    """Mark where all of 3 x 3 flags are set; write the ends of what is marked."""
    line, flags, start = mask[row], mask.reshape(-1), row * mask.shape[1]
    for column in range(columns):
        line[column] = (one[column] & one[column + 1] & one[column + 2]
                        & two[column] & two[column + 1] & two[column + 2]
                        & three[column] & three[column + 1] & three[column + 2])
    ends[row] = columns, 0
    for column in range(0, columns, LANES):
        if equal_bits(load(flags, start + column), splat(np.uint8(0))) != NONE:
            ends[row, 0] = min(ends[row, 0], column)
            ends[row, 1] = min(column + LANES, columns)


@kernel
def mask_regions(mask, ends, begin, end, parent, row_runs):
    """
    Write the runs of a mask, and join those that touch the row above.

    mask: uint8 (r, ...), ends: int32 (r, 2): see plain_mask; begin, end, parent, row_runs: as of
    segments.find_runs
    """
    known = np.int64(0)
    above = np.int64(0)
    for row in range(mask.shape[0]):
        line, column, columns = mask[row], np.int64(ends[row, 0]), np.int64(ends[row, 1])
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


@inlined
def _none(flags):
    """Return whether no lane of a mask is set."""
    return equal_bits(flags, splat(np.uint16(0))) == NONE


@inlined
def _widen_row(line, ends, offset, existing, wide, full):
    """
    Spread a row of a half-size mask over full columns from `offset` on, where they are inside.

    full: int64 (2,), the first marked element of the wide row and the one behind the last
    """
    first = max(np.int64(ends[0]), (max(existing[0] - offset, 0) + 1) // 2)
    last = max(min(np.int64(ends[1]), (existing[1] - offset + 1) // 2), first)
    wide[full[0]:full[1]] = 0
    full[0], full[1] = 2 * first + offset + PAD, 2 * last + offset + PAD
    flags, target = line[first:last], wide[full[0]:full[1]]
    for column in range(len(flags)):
        flag = np.uint16(PLAIN) * flags[column]
        target[2 * column] = flag
        target[2 * column + 1] = flag


@inlined
def _mean_of_row(luminance, place, stride, mask, picture, row, ends):
    """
    Write the binomial mean of 3 x 3 pixels of a row, a quarter, near those of a mask.

    luminance: uint16, flat; place: of the pixel of element 0; mask, picture: uint16, flat; row:
    where their row begins; ends: elements
    """
    for element in range(ends[0], ends[1], LANES):
        if _none(load(mask, row + element)):
            continue
        sums = splat(np.uint16(2))
        for line in range(3):
            middle = place + (line - 1) * stride + element
            across = shift_right(add(
                add(shift_right(load(luminance, middle - 1), 2),
                    shift_right(load(luminance, middle + 1), 2)),
                shift_left(shift_right(load(luminance, middle), 2), 1)), 2)
            sums = add(sums, shift_left(across, line & 1))
        store(picture, row + element, shift_right(sums, 2))


@inlined
def _mean_of_three(picture, mask, before, row, after, result, ends):
    """
    Write the binomial mean of the elements of a row with those of two others, or of itself moved.

    Others than those of the mask count as the element itself. picture, mask, result: uint16, flat;
    before, row, after: where rows begin
    """
    for element in range(ends[0], ends[1], LANES):
        if _none(load(mask, row + element)):
            continue
        here = load(picture, row + element)
        sums = add(splat(np.uint16(2)), shift_left(here, 2))
        for other in (before + element, after + element):
            sums = add(sums, bit_and(subtract(load(picture, other), here), load(mask, other)))
        store(result, row + element, shift_right(sums, 2))


@inlined
def _subtract_row(fine, coarse, mask, row, band, target, ends, sums):
    """Write the difference of two means of a row inside a mask; add its size to `sums`."""
    size = number = 0
    for element in range(ends[0], ends[1], LANES):
        plain = load(mask, row + element)
        if _none(plain):
            continue
        difference = bit_and(subtract(load(fine, row + element), load(coarse, row + element)),
                             plain)
        store(band, target + element, difference)
        size += total(minimum(difference, subtract(splat(np.uint16(0)), difference)))
        number += total(shift_right(plain, 15))
    sums[0] += size
    sums[1] += number


@kernel(allocates=True)
def split(luminance, mask, ends, offset, existing, bands, seen, written, sums, first, last):
    """
    Split the texture of every other row into bands, fine to coarse, where the picture is plain.

    Each is the difference of a mean of pixels and a wider one: of 3 x 3 pixels, then of a row's
    pixels 2 apart and those of the rows above and below, then of twice as far ones.
    luminance: uint16 (R, ...), with a margin; mask, ends: see plain_mask; offset: full column of
    its first pixel; existing: first and last full column that exist; bands: int16 (BANDS, r, ...);
    seen: uint16, the mask at full width, PLAIN or 0, in as many columns; written: int64 (r, 2),
    elements of a row that may not be 0; sums: int64 (BANDS, 3), whose sizes and counts are written
    """
    rows, wide, stride = len(mask), bands.shape[2], luminance.shape[1]
    source, target = luminance.reshape(-1), bands.view(np.uint16).reshape(-1)
    # as many rows as the means reach over, one behind the other
    rings = np.zeros((6, RING * wide), np.uint16)
    flags, fine, across, medium, farther, coarse = (rings[0], rings[1], rings[2], rings[3],
                                                    rings[4], rings[5])
    full = np.zeros((RING, 2), np.int64)
    sums[:] = 0
    for newest in range(max(first - REACH, 0), last + REACH):
        if newest < rows:
            row, of_row = newest % RING * wide, full[newest % RING]
            _widen_row(mask[newest], ends[newest], offset, existing, flags[row:row + wide], of_row)
            _mean_of_row(source, (2 * newest + MARGIN) * stride + MARGIN - PAD, stride, flags,
                         fine, row, of_row)
            before, after = row - 2, row + 2
            _mean_of_three(fine, flags, before, row, after, across, of_row)
        near = newest - 1
        if max(first - REACH + 1, 0) <= near < min(last + REACH - 1, rows):
            row, of_row = near % RING * wide, full[near % RING]
            before, after = max(near - 1, 0) % RING * wide, min(near + 1, rows - 1) % RING * wide
            _mean_of_three(across, flags, before, row, after, medium, of_row)
            before, after = row - 4, row + 4
            _mean_of_three(medium, flags, before, row, after, farther, of_row)
        mine = newest - REACH
        if first <= mine:
            row, of_row, place = mine % RING * wide, full[mine % RING], mine * wide
            before = (mine - 2 if mine >= 2 else mine) % RING * wide
            after = (mine + 2 if mine + 2 < rows else mine) % RING * wide
            _mean_of_three(farther, flags, before, row, after, coarse, of_row)
            begin, end = written[mine]
            seen[mine, begin:end] = 0
            bands[:, mine, begin:end] = 0
            written[mine] = of_row
            begin, end = of_row
            seen[mine, begin:end] = flags[row + begin:row + end]
            _subtract_row(fine, medium, flags, row, target, place, of_row, sums[0])
            _subtract_row(medium, coarse, flags, row, target, rows * wide + place, of_row, sums[1])


@kernel
def quantise(bands, written, clips, sums, first, last):
    """
    Scale bands so that a band's clip and what is beyond become LARGEST; write sums of squares.

    bands, written, sums: of split; clips: int64 (BANDS,), above LARGEST
    """
    values = bands.view(np.uint16).reshape(-1)
    for band in range(BANDS):
        scale, power = splat(np.uint16(2 * LARGEST * 2**15 // clips[band])), 0
        for row in range(first, last):
            start = (band * bands.shape[1] + row) * bands.shape[2]
            for place in range(start + written[row, 0], start + written[row, 1], LANES):
                value = load(values, place)
                negative = less(splat(np.uint16(2**15 - 1)), value)
                size = subtract(bit_xor(value, negative), negative)
                size = minimum(shift_left(size, 1), splat(np.uint16(PLAIN)))
                size = shift_right(add(high_product(size, scale), splat(np.uint16(1))), 1)
                size = minimum(size, splat(np.uint16(LARGEST)))
                power += total(multiply(size, size))
                store(values, place, subtract(bit_xor(size, negative), negative))
        sums[band, 2] = power


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
    how many candidates are seen, in every COUNTED-th row; cells: int32 (cells, 4 + BANDS): number
    of half-size pixels, sums of their columns, rows and labels, and the power of each band; first,
    last: the rows of whole cells
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
def write_planes(begin, end, row_runs, region, places, accepted, planes, half_disparities,
                 half_labels, disparities, labels, weights, weight, first, last):
    """
    Write planes into a half-size map and into the prior of the full search, in accepted cells.

    accepted: uint8, by cell; planes: float64 (regions, 3), of half-size x and y and full
    disparity; half_labels: (r, c); labels, weights: (R, C), of the prior; first, last: half-size
    rows
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
                if accepted[places[region[run], row // ROWS, half // (COLUMNS // 2)]]:
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
