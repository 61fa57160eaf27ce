# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The faint texture of plain parts of a view, in two bands, and its products with candidates.

One pixel of a plain wall does not determine its disparity; all of its pixels together do.

Plain is what has small steps in the half-size view. Pictures are measured on every other row.
Their texture is split by differences of binomial means inside the mask of plain pixels, so that
edges outside the mask add nothing. A mask is written in blocks of LANES columns: kernels can pass
over what has no marked pixel.
"""
from typing import NamedTuple

from fuzzy_stereo_ros.matching.kernels.compiled import inlined, kernel
from fuzzy_stereo_ros.matching.kernels.possibility.features import MARGIN
from fuzzy_stereo_ros.matching.kernels.simd import (
    add, bit_and, bit_xor, equal_bits, high_product, LANES, less, load, minimum, multiply,
    shift_left, shift_right, splat, store, subtract, total)
import numpy as np

COLUMNS_AROUND = 4   # columns around a picture, as far as the widest mean reaches
BANDS = 2            # of texture: 1 to 2 px and 2 to 4 px
LARGEST_VALUE = 11   # value of a quantised band: the sums of a cell stay below 2**15
SET_PIXEL = 2**16 - 1  # value of a set pixel in a mask at full width
MEAN_REACH = 3       # rows that the means of a row reach over, above and below
RING = 8             # rows, at least 2 * MEAN_REACH + 1
COUNTED = 4          # every COUNTED-th row is counted
NONE = np.uint32(0xFFFFFFFF)     # the bits of lanes equal to 0 where no lane of a mask is set


class PlainMask(NamedTuple):
    """Where a half-size view is plain."""

    mask: np.ndarray         # uint8 (r, c + LANES)
    ends: np.ndarray         # int32 (r, 2), begin of the first and end of the last block of LANES
    #                          columns in which a pixel of the row is marked


class TextureBands(NamedTuple):
    """The texture of one view in bands, fine to coarse, of every other row."""

    values: np.ndarray       # int16 (BANDS, r, ...), with COLUMNS_AROUND columns before the first
    seen: np.ndarray         # uint16 (r, ...), the mask at full width, SET_PIXEL or 0
    written: np.ndarray      # int64 (r, 2), elements of a row that may not be 0


@kernel(allocates=True)
def plain_mask(luminance, columns, burnt, limit, plain, first, last):
    """
    Mark the half-size pixels all of whose 3 x 3 pixels have small steps and are not burnt out.

    A step is that of the smoothed picture in the direction of the largest, 1/64 grey level a px.
    luminance: uint16, with a margin; burnt: luminance from which a pixel is burnt out; limit: of
    steps; plain: the fields of PlainMask, written; first, last: rows
    """
    mask, ends = plain
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
                smooth[column] = (np.int32(a[column]) + e[column] + 6 * np.int32(c[column])
                                  + 4 * (np.int32(b[column]) + d[column]))
            for column in range(wide):      # apart: LLVM compares few arrays in a loop
                slope[column] = (np.int32(e[column]) - a[column]
                                 + 2 * (np.int32(d[column]) - b[column]))
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
    ends[row, 0], ends[row, 1] = columns, 0
    for column in range(0, columns, LANES):
        if equal_bits(load(flags, start + column), splat(np.uint8(0))) != NONE:
            ends[row, 0] = min(ends[row, 0], column)
            ends[row, 1] = min(column + LANES, columns)


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
    full[0], full[1] = 2 * first + offset + COLUMNS_AROUND, 2 * last + offset + COLUMNS_AROUND
    flags, target = line[first:last], wide[full[0]:full[1]]
    for column in range(len(flags)):
        flag = np.uint16(SET_PIXEL) * flags[column]
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
def split(luminance, plain, offset, existing, texture, sums, first, last):
    """
    Split the texture of every other row into bands, fine to coarse, where the picture is plain.

    Each is the difference of a mean of pixels and a wider one: of 3 x 3 pixels, then of a row's
    pixels 2 apart and those of the rows above and below, then of twice as far ones.
    luminance: uint16 (R, ...), with a margin; plain: the fields of PlainMask; offset: full column
    of its first pixel; existing: first and last full column that exist; texture: the fields of
    TextureBands; sums: int64 (BANDS, 2), whose sizes and counts are written
    """
    (mask, ends), (bands, seen, written) = plain, texture
    rows, wide, stride = len(mask), bands.shape[2], luminance.shape[1]
    source, target = luminance.reshape(-1), bands.view(np.uint16).reshape(-1)
    # as many rows as the means reach over, one behind the other
    rings = np.zeros((6, RING * wide), np.uint16)
    flags, fine, across, medium, farther, coarse = (rings[0], rings[1], rings[2], rings[3],
                                                    rings[4], rings[5])
    full = np.zeros((RING, 2), np.int64)
    sums[:] = 0
    for newest in range(max(first - MEAN_REACH, 0), last + MEAN_REACH):
        if newest < rows:
            row, of_row = newest % RING * wide, full[newest % RING]
            _widen_row(mask[newest], ends[newest], offset, existing, flags[row:row + wide], of_row)
            _mean_of_row(source, (2 * newest + MARGIN) * stride + MARGIN - COLUMNS_AROUND, stride,
                         flags, fine, row, of_row)
            before, after = row - 2, row + 2
            _mean_of_three(fine, flags, before, row, after, across, of_row)
        near = newest - 1
        if max(first - MEAN_REACH + 1, 0) <= near < min(last + MEAN_REACH - 1, rows):
            row, of_row = near % RING * wide, full[near % RING]
            before, after = max(near - 1, 0) % RING * wide, min(near + 1, rows - 1) % RING * wide
            _mean_of_three(across, flags, before, row, after, medium, of_row)
            before, after = row - 4, row + 4
            _mean_of_three(medium, flags, before, row, after, farther, of_row)
        mine = newest - MEAN_REACH
        if first <= mine:
            row, of_row, place = mine % RING * wide, full[mine % RING], mine * wide
            before = (mine - 2 if mine >= 2 else mine) % RING * wide
            after = (mine + 2 if mine + 2 < rows else mine) % RING * wide
            _mean_of_three(farther, flags, before, row, after, coarse, of_row)
            begin, end = written[mine]
            seen[mine, begin:end] = 0
            bands[:, mine, begin:end] = 0
            begin, end = of_row
            written[mine, 0], written[mine, 1] = begin, end
            for element in range(begin, end):
                seen[mine, element] = flags[row + element]
            _subtract_row(fine, medium, flags, row, target, place, of_row, sums[0])
            _subtract_row(medium, coarse, flags, row, target, rows * wide + place, of_row, sums[1])


@kernel
def quantise(bands, written, clips, first, last):
    """
    Scale bands so that a clip and what is beyond become LARGEST_VALUE.

    bands, written: of TextureBands; clips: int64 (BANDS,), above LARGEST_VALUE
    """
    values = bands.view(np.uint16).reshape(-1)
    for band in range(BANDS):
        scale = splat(np.uint16(2 * LARGEST_VALUE * 2**15 // clips[band]))
        for row in range(first, last):
            start = (band * bands.shape[1] + row) * bands.shape[2]
            for place in range(start + written[row, 0], start + written[row, 1], LANES):
                value = load(values, place)
                negative = less(splat(np.uint16(2**15 - 1)), value)
                size = subtract(bit_xor(value, negative), negative)
                size = minimum(shift_left(size, 1), splat(np.uint16(SET_PIXEL)))
                size = shift_right(add(high_product(size, scale), splat(np.uint16(1))), 1)
                size = minimum(size, splat(np.uint16(LARGEST_VALUE)))
                store(values, place, subtract(bit_xor(size, negative), negative))


@kernel
def vote(pieces, left, right, seen, curves, counts):
    """
    Sum the products of the bands of pieces with those of all candidates, and count what is seen.

    pieces: of list_pieces; left, right: the values of both TextureBands, the right one mirrored;
    seen: of the right one; curves, counts: of Votes
    """
    labels, (rows, stride) = curves.shape[2], right.shape[1:]
    base = left.shape[2] - LANES - COLUMNS_AROUND - 1       # the candidate of column 0, label 0
    sums, source = curves.view(np.uint16).reshape(-1), right.view(np.uint16).reshape(-1)
    numbers, flags = counts.view(np.uint16).reshape(-1), seen.reshape(-1)
    for piece in range(len(pieces)):
        place, row = np.int64(pieces[piece, 0]), np.int64(pieces[piece, 1])
        first, last = 2 * np.int64(pieces[piece, 2]), 2 * np.int64(pieces[piece, 3])
        for band in range(BANDS):
            line = left[band, row, COLUMNS_AROUND:]
            for block in range(0, labels, LANES):
                sum_at = (place * BANDS + band) * labels + block
                products = load(sums, sum_at)
                candidate = (band * rows + row) * stride + base + block
                for column in range(first, last):
                    products = add(products, multiply(
                        splat(np.uint16(line[column])), load(source, candidate - column)))
                store(sums, sum_at, products)
        if row % COUNTED == 0:
            for block in range(0, labels, LANES):
                candidate = row * stride + base + block
                known = load(numbers, place * labels + block)
                for column in range(first, last):
                    known = subtract(known, load(flags, candidate - column))
                store(numbers, place * labels + block, known)
