# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Features of an image: 16-bit luminance, 8-bit grey, census, gradient, penalties of jumps.

Images of the target are mirrored: its column c, from -extra on, lies at index `columns - 1 - c`,
so that the candidates of a pixel, disparities upwards, are one contiguous load.
"""
from fuzzy_stereo_ros.matching.kernels.compiled import called, inlined, kernel
from fuzzy_stereo_ros.matching.kernels.rows import pad_row
from fuzzy_stereo_ros.matching.kernels.simd import (
    add, bit_or, bit_xor, equal, LANES, lanes_in_llvm, less, load, minimum, narrow, read,
    reversed_lanes, saturating_subtract, shift_left, shift_right, shuffled, splat, store,
    subtract, VECTOR)
from numba import types
from numba.extending import intrinsic
import numpy as np

MARGIN = 2       # pixels around a padded image: the radius of the census window
SLACK = 64       # elements behind a row that a vector may read or write
DENOISED = 2 * MARGIN + 1    # denoised rows that are kept
# The places in 5 x 5 pixels, row by row, of each bit of the census: the nearest eight come first.
CENSUS_PLACES = np.array([6, 7, 8, 11, 13, 16, 17, 18, 0, 1, 2, 3, 4, 5, 9, 10, 14, 15, 19, 20,
                          21, 22, 23, 24])


@intrinsic
def load_colours(typing, array, index):
    """Return the blue, green and red of LANES pixels of 8 bits from `index` on, in 16 bits."""
    signature = types.UniTuple(VECTOR[16], 3)(array, types.intp)

    def generate(context, builder, signature, arguments):
        pixels = read(context, builder, array, arguments, lanes_in_llvm(8, 3 * LANES))
        channels = [builder.zext(
            shuffled(builder, pixels, pixels, list(range(channel, 3 * LANES, 3))),
            lanes_in_llvm(16))
            for channel in range(3)]
        return context.make_tuple(builder, signature.return_type, channels)
    return signature, generate


@kernel
def luminance_of(image, shift, left_shift, mirrored, luminance, grey, first, last):
    """
    Write the luminance, of colours B + 2 G + R, in 16 bits for the census and in 8 for the rest.

    image: uint8 or uint16 (R, C, 3), or (R, C); shift: columns to move the image to the right;
    luminance: uint16 (R + 4, C + 4 + SLACK), times 2**left_shift, at most 65535, written inside
    its margin; grey: uint8 (R, C + SLACK), luminance / 256, rounded.
    """
    columns = image.shape[1]
    for row in range(first, last):
        for column in range(columns):
            source = min(max(column - shift, 0), columns - 1)
            if image.ndim == 3:
                value = (np.uint32(image[row, source, 0]) + np.uint32(2) * image[row, source, 1]
                         + np.uint32(image[row, source, 2]))
                value = (value << np.uint32(left_shift) if left_shift >= 0
                         else value >> np.uint32(-left_shift))
            else:       # never shifted to the right
                value = np.uint32(image[row, source]) << np.uint32(left_shift)
            target = columns - 1 - column if mirrored else column
            luminance[row + MARGIN, target + MARGIN] = min(value, np.uint32(65535))
            grey[row, target] = min((value + np.uint32(128)) >> np.uint32(8), np.uint32(255))
        pad_row(luminance, row, columns, MARGIN)


@kernel
def luminance_of_bytes(image, left_shift, mirrored, luminance, grey, first, last):
    """Write the same of uint8 (R, C, 3), C >= LANES, with no shift to the right, much faster."""
    columns = image.shape[1]
    pixels, flat, grey_flat = image.reshape(-1), luminance.reshape(-1), grey.reshape(-1)
    luminance_stride, grey_stride = luminance.shape[1], grey.shape[1]
    brightest = splat(np.uint16(65535 >> left_shift))
    for row in range(first, last):
        for chunk in range(0, columns, LANES):
            column = min(chunk, columns - LANES)
            blue, green, red = load_colours(pixels, 3 * (row * columns + column))
            weighted = add(add(blue, red), add(green, green))
            value = bit_or(shift_left(weighted, left_shift), less(brightest, weighted))
            rounded = narrow(minimum(
                shift_right(add(shift_right(value, 7), splat(np.uint16(1))), 1),
                splat(np.uint16(255))))
            if mirrored:
                value, rounded = reversed_lanes(value, value), reversed_lanes(rounded, rounded)
                column = columns - LANES - column
            store(flat, (row + MARGIN) * luminance_stride + column + MARGIN, value)
            store(grey_flat, row * grey_stride + column, rounded)
        pad_row(luminance, row, columns, MARGIN)


@kernel
def spread(picture, begin, wide, first, last):
    """
    Copy an image into a wider one, from its column `begin` on; border pixels fill the rest.

    picture, wide: luminance and grey; columns beyond the wider one are not copied.
    """
    (luminance, grey), (wide_luminance, wide_grey) = picture, wide
    columns, wide_columns = grey.shape[1] - SLACK, wide_grey.shape[1] - SLACK
    for row in range(first, last):
        _spread_row(luminance[row + MARGIN, MARGIN:columns + MARGIN], begin,
                    wide_luminance[row + MARGIN, MARGIN:wide_columns + MARGIN])
        pad_row(wide_luminance, row, wide_columns, MARGIN)
        _spread_row(grey[row, :columns], begin, wide_grey[row, :wide_columns])


@called
def _spread_row(line, begin, wide):
    inside = max(min(len(line), len(wide) - begin), 0)
    wide[:begin] = line[0]
    for column in range(inside):
        wide[begin + column] = line[column]
    wide[begin + inside:] = line[-1]


@kernel
def halve(luminance, grey, columns, offset, half_luminance, half_grey, first, last):
    """
    Halve an image by the mean of 2 x 2 pixels, for the half rows first to last.

    columns: of the half image; offset: first column used of the full one.
    """
    begin = MARGIN + offset
    for row in range(first, last):
        above, below = luminance[2 * row + MARGIN, begin:], luminance[2 * row + 1 + MARGIN, begin:]
        line = half_luminance[row + MARGIN, MARGIN:]
        for column in range(columns):
            left = 2 * column
            line[column] = (np.uint32(above[left]) + above[left + 1] + below[left]
                            + below[left + 1]) >> np.uint32(2)
        pad_row(half_luminance, row, columns, MARGIN)
        above_grey, below_grey = grey[2 * row, offset:], grey[2 * row + 1, offset:]
        for column in range(columns):
            left = 2 * column
            half_grey[row, column] = (
                np.uint16(above_grey[left]) + above_grey[left + 1] + below_grey[left]
                + below_grey[left + 1] + np.uint16(2)) >> np.uint16(2)


@called
def _denoise(luminance, row, tolerance, columns, totals, denoised):
    """
    Replace each pixel of a row by its 3 x 3 mean where both differ by no more than a tolerance.

    A third of the noise is left in plain regions; pixels that differ more stay (coring).
    luminance: uint16, padded; tolerance: in units of it; totals: uint32 (C + 2,), memory;
    denoised: uint16, a padded row
    """
    above, here = luminance[row + MARGIN - 1], luminance[row + MARGIN]
    below = luminance[row + MARGIN + 1]
    for column in range(columns + 2):
        place = column + MARGIN - 1
        totals[column] = np.uint32(above[place]) + here[place] + below[place]
    line, limit = denoised[MARGIN:], np.int32(9 * tolerance)
    for column in range(columns):
        grey = np.int32(here[column + MARGIN])
        total = np.int32(totals[column] + totals[column + 1] + totals[column + 2])
        mean = np.int32(np.float32(total) * np.float32(1 / 9))
        line[column] = grey if abs(9 * grey - total) > limit else mean
    denoised[:MARGIN] = denoised[MARGIN]
    denoised[columns + MARGIN:] = denoised[columns + MARGIN - 1]


@called
def _compare(near, far, centres, places, least_step, columns, codes):
    """
    Compare each of the 24 neighbours in 5 x 5 with the centre: a bit each, set where darker.

    near, far: flat pictures in which the nearest eight and the others are compared; centres,
    places: where the first pixel of the row, and its neighbours, lie in these; codes: uint8 (3,
    stride), a byte plane for eight neighbours, the nearest ones first
    """
    target, stride = codes.reshape(-1), codes.shape[1]
    for column in range(0, columns, LANES):
        for plane in range(3):
            source = near if plane == 0 else far
            centre = saturating_subtract(
                load(source, centres[plane] + column), splat(np.uint16(least_step)))
            code = splat(np.uint16(0))      # of bits that are set where no darker
            for place in places[8 * plane:8 * plane + 8][::-1]:
                code = subtract(add(code, code), equal(saturating_subtract(
                    centre, load(source, place + column)), splat(np.uint16(0))))
            store(target, plane * stride + column,
                  narrow(bit_xor(code, splat(np.uint16(255)))))


@called
def _find_slopes(grey, mirrored, columns, slopes):
    """Write half of the central difference along a row, 128 where flat and at the borders."""
    sign = np.int16(-1 if mirrored else 1)
    for column in range(1, columns - 1):
        step = np.int16(sign * (np.int16(grey[column + 1]) - np.int16(grey[column - 1])))
        slopes[column] = np.int16(128) + (step >> np.int16(1))
    slopes[0] = 128
    slopes[columns - 1:] = 128


@kernel(allocates=True)
def describe(view, tolerance, least_step, mirrored, columns, codes, slopes, first, last):
    """
    Write census and slopes of the rows of a view.

    view: luminance, uint16, padded, and grey, uint8 (R, C + SLACK); tolerance: of luminance, for
    denoising what the farther pixels are compared in, 0 for none; least_step: of luminance, more
    than which a neighbour must be darker; codes: uint8 (R, 3, stride), see _compare; slopes: uint8
    (R, stride); behind the columns the last code and slope are repeated
    """
    (luminance, grey), rows = view, len(codes)
    near, stride = luminance.reshape(-1), luminance.shape[1]
    denoised, totals = np.empty((DENOISED, stride), np.uint16), np.empty(columns + 2, np.uint32)
    far = denoised.reshape(-1) if tolerance else near
    across = 4 - CENSUS_PLACES % 5 if mirrored else CENSUS_PLACES % 5
    centres, places = np.empty(3, np.int64), np.empty(CENSUS_PLACES.size, np.int64)
    ready = max(first - MARGIN, 0)
    for row in range(first, last):
        if tolerance:
            for new in range(ready, min(row + MARGIN + 1, rows)):
                _denoise(luminance, new, tolerance, columns, totals, denoised[new % DENOISED])
            ready = row + MARGIN + 1
        for neighbour in range(CENSUS_PLACES.size):
            down = row + CENSUS_PLACES[neighbour] // 5
            if tolerance and neighbour >= 8:
                down = min(max(down - MARGIN, 0), rows - 1) % DENOISED
            places[neighbour] = down * stride + across[neighbour]
        centres[:] = (row + MARGIN) * stride + MARGIN
        if tolerance:
            centres[1:] = row % DENOISED * stride + MARGIN
        _compare(near, far, centres, places, least_step, columns, codes[row])
        for plane in range(3):
            codes[row, plane, columns:] = codes[row, plane, columns - 1]
        _find_slopes(grey[row], mirrored, columns, slopes[row])


@kernel
def jump_penalties(grey, jump, jump_at_edge, slope, across, down, first, last):
    """
    Write the penalty of a jump of disparity (P2) at each pixel, by the step of grey there.

    jump, jump_at_edge: the penalty where grey is flat, and the smallest one; slope: by how much
    it falls in 256 grey levels; across, down: uint8 (R, C), between a pixel and its left, its
    upper neighbour.
    """
    high, low, fall = np.int16(jump), np.int16(jump_at_edge), np.uint16(slope)
    for row in range(first, last):
        here, above = grey[row], grey[max(row - 1, 0)]
        left, up = across[row], down[row]
        left[0] = jump
        for column in range(1, left.size):
            left[column] = _penalty(here[column], here[column - 1], high, low, fall)
        for column in range(up.size):
            up[column] = _penalty(here[column], above[column], high, low, fall)


@inlined
def _penalty(one, other, high, low, fall):
    """Return the penalty between two grey levels; all in 16 bits, so that vectors are of those."""
    step = np.uint16(max(one, other) - min(one, other))
    fallen = np.uint16(np.uint16(min(step, np.uint16(63)) * fall) >> np.uint16(8))
    return max(np.int16(high - np.int16(fallen)), low)
