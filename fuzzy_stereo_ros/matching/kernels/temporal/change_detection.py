# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Compare the tiles of a picture with the previous one, and average the unchanged ones with it.

Differences are taken in 1 / 32 grey level of 8 bits, so that sums of four fit 16 bits.
"""
from fuzzy_stereo_ros.matching.kernels.addresses import of_rank
from fuzzy_stereo_ros.matching.kernels.compiled import called, inlined, kernel
from fuzzy_stereo_ros.matching.kernels.possibility.features import MARGIN
from fuzzy_stereo_ros.matching.kernels.rows import copy_row, pad_row
from fuzzy_stereo_ros.matching.kernels.simd import (
    absolute_difference, add, bit_and, LANES, largest_of_halves, load, maximum, neighbours,
    pair_products, shift_left, shift_right, signed_high_product, signed_maximum, signed_minimum,
    splat_like, subtract, sums_of_halves)
import numpy as np

TILE = 16        # pixels of a side of the tiles that are compared
BLOCK = 4        # pixels of a side of the blocks whose mean differences are compared
DROPPED_BITS = 3    # low bits of luminance that a comparison drops
UNITS = 32       # units of a compared difference in a grey level
# larger slopes and differences of sums of BLOCK rows are cut, bits of products are dropped, to fit
LARGEST_SLOPE, PRODUCT_BITS = 1024, 8
LEAST_VARIED = 0.02     # share of the squares of slopes that is left without their mean
SIZE_OF_NOISE = 0.8     # mean size of white noise of 1
SECOND = 1.954          # mean size of its second differences
PLAINEST = 0.1          # share of the tiles, those of least second differences, that show noise
LOST = 0.75             # share of the variance of noise that halving a picture removes


# What is measured of a tile, see compare_tiles.
MEASURES = 8
SIZE, BLOCKS, PEAK, BUMP, MOTION, VARIANCE, STEEPNESS, BRIGHTNESS = range(MEASURES)
_DIFFERENCE, _SLOPE = MEASURES, MEASURES + 1    # sums that MOTION is made of


@kernel(allocates=True)
def compare_tiles(now, before, down, right, differences, first, last):
    """
    Measure how tiles of a picture differ from the picture before, moved down and to the right.

    differences: float32 (MEASURES, tile rows, tile columns), of which the tile rows first .. last
    are written:

    SIZE: the mean absolute difference of pixels, grey levels; infinite for tiles that show nothing
    of the picture before
    BLOCKS: the mean absolute value of the mean differences of blocks, times BLOCK, grey levels;
    that of white noise is as large as the difference of pixels
    PEAK: the largest absolute mean difference of a block, grey levels
    BUMP: the largest mean absolute difference of a block, grey levels
    MOTION: the covariance of differences and slopes along the row, of sums of BLOCK rows, in units
    of its own; its sign is that of a motion, and a change of light leaves it as it is
    VARIANCE: its variance if all differences are noise
    STEEPNESS: the sum of the squares of the slopes
    BRIGHTNESS: the mean grey level before
    """
    rows, columns = before.shape
    top, bottom = max(down, 0), rows + min(down, 0)
    begin, end = max(right, 0), columns + min(right, 0)
    width = columns + 2 * LANES
    compared, old = np.zeros(width, np.uint16), np.zeros((TILE, width), np.uint16)
    compared[begin:max(begin, end)] = 65535
    sums = np.zeros((MEASURES + 2, differences.shape[2] + 1), np.int64)
    for tile_row in range(first, last):
        above, below = max(tile_row * TILE, top), min((tile_row + 1) * TILE, bottom)
        if end > begin:
            for row in range(above, below):
                line = old[row % TILE]
                _copy_coarse(before[row - down, begin - right:end - right], line[begin + 1:])
                line[begin], line[end + 1] = line[begin + 1], line[end]
        for tile in range(0, differences.shape[2], LANES // TILE):
            _compare(now, old, (above, below), load(compared, tile * TILE), tile, sums)
        _write_measures(sums, max(below - above, 0), begin, end, differences[:, tile_row])


@called
def _copy_coarse(line, coarse):
    """Copy luminance, in 1 / UNITS grey level."""
    for column in range(len(line)):
        coarse[column] = line[column] >> np.uint16(DROPPED_BITS)


@inlined
def _compare(now, old, rows, compared, tile, sums):
    """
    Sum up the LANES columns from a tile on, of which some are compared.

    old: rows of the picture before from one column to the left on; sums: int64 (MEASURES + 2,
    tiles), written
    """
    (above, below), stride, width = rows, now.shape[1], old.shape[1]
    now, old = now.reshape(-1), old.reshape(-1)
    left, none = tile * TILE, subtract(compared, compared)
    one, steepest = splat_like(none, 1), splat_like(none, LARGEST_SLOPE)
    flattest = subtract(none, steepest)
    total = blocks = peak = bump = motion = variance = pair_products(none, none)
    difference = slopes = steepness = brightness = nothing = total
    for strip in range(above // BLOCK * BLOCK, below, BLOCK):
        change = size = grey = before = behind = none
        for row in range(max(strip, above), min(strip + BLOCK, below)):
            place = row % TILE * width + left
            here = shift_right(load(now, (row + MARGIN) * stride + left + MARGIN), DROPPED_BITS)
            there = load(old, place + 1)
            change = add(change, subtract(here, there))
            size = add(size, absolute_difference(here, there))
            grey = add(grey, there)
            before, behind = add(before, load(old, place)), add(behind, load(old, place + 2))
        change, size = bit_and(change, compared), bit_and(size, compared)
        of_pairs, sizes = pair_products(change, one), pair_products(size, one)
        # both pairs of columns of a block hold its sum
        block = add(of_pairs, neighbours(of_pairs, of_pairs))
        block = signed_maximum(block, subtract(nothing, block))
        blocks, peak = add(blocks, block), maximum(peak, block)
        total, bump = add(total, sizes), maximum(bump, add(sizes, neighbours(sizes, sizes)))
        change = signed_maximum(signed_minimum(change, steepest), flattest)
        slope = bit_and(signed_maximum(signed_minimum(
            subtract(behind, before), steepest), flattest), compared)
        product = signed_high_product(shift_left(slope, 8 - PRODUCT_BITS // 2),
                                      shift_left(change, 8 - PRODUCT_BITS // 2))
        motion = add(motion, pair_products(product, one))
        variance = add(variance, pair_products(product, product))
        difference = add(difference, pair_products(change, one))
        slopes = add(slopes, pair_products(slope, one))
        steepness = add(steepness, pair_products(slope, slope))
        brightness = add(brightness, pair_products(bit_and(grey, compared), one))
    sums[SIZE, tile], sums[SIZE, tile + 1] = sums_of_halves(total)
    sums[BLOCKS, tile], sums[BLOCKS, tile + 1] = sums_of_halves(blocks)
    sums[PEAK, tile], sums[PEAK, tile + 1] = largest_of_halves(peak)
    sums[BUMP, tile], sums[BUMP, tile + 1] = largest_of_halves(bump)
    sums[MOTION, tile], sums[MOTION, tile + 1] = sums_of_halves(motion)
    sums[VARIANCE, tile], sums[VARIANCE, tile + 1] = sums_of_halves(variance)
    sums[STEEPNESS, tile], sums[STEEPNESS, tile + 1] = sums_of_halves(steepness)
    sums[BRIGHTNESS, tile], sums[BRIGHTNESS, tile + 1] = sums_of_halves(brightness)
    sums[_DIFFERENCE, tile], sums[_DIFFERENCE, tile + 1] = sums_of_halves(difference)
    sums[_SLOPE, tile], sums[_SLOPE, tile + 1] = sums_of_halves(slopes)


@called
def _write_measures(sums, height, begin, end, found):
    """Write `differences` of a row of tiles, `height` rows of which the picture before shows."""
    unit = np.float32(1 / UNITS)
    for tile in range(found.shape[1]):
        left, slope, steepness = tile * TILE, sums[_SLOPE, tile], sums[STEEPNESS, tile]
        number = height * max(min(left + TILE, end) - max(left, begin), 0)
        found[SIZE, tile] = (
            sums[SIZE, tile] * unit / np.float32(number) if number > 0 else np.inf)
        found[BLOCKS, tile] = (sums[BLOCKS, tile] // 2 * unit * np.float32(BLOCK)
                               / np.float32(max(number, 1)))
        found[PEAK, tile] = sums[PEAK, tile] * unit / np.float32(BLOCK * BLOCK)
        found[BUMP, tile] = sums[BUMP, tile] * unit / np.float32(BLOCK * BLOCK)
        mean_slope = np.float32(slope) / np.float32(max(number // BLOCK, 1))
        varies = np.float32(1) - mean_slope * np.float32(slope) / np.float32(max(steepness, 1))
        varies = varies if varies > np.float32(LEAST_VARIED) else np.float32(0)
        found[MOTION, tile] = (
            np.float32(sums[MOTION, tile]) - mean_slope * np.float32(sums[_DIFFERENCE, tile])
            / np.float32(1 << PRODUCT_BITS)) if varies > 0 else np.float32(0)
        found[VARIANCE, tile] = np.float32(sums[VARIANCE, tile]) * varies
        found[STEEPNESS, tile] = np.float32(steepness)
        found[BRIGHTNESS, tile] = sums[BRIGHTNESS, tile] * unit / np.float32(max(number, 1))


@called
def _add_bends(line, columns, totals):
    """Add the second differences along a row, with an element before and behind it."""
    for column in range(columns):
        totals[column] += abs(2 * np.int32(line[column + 1]) - np.int32(line[column])
                              - np.int32(line[column + 2]))


@called
def _mean_of_tiles(totals, number, columns, rough):
    """Write the means of sums of so many rows of tiles, in grey levels."""
    for tile in range(rough.size):
        total = 0
        for column in range(tile * TILE, (tile + 1) * TILE):
            total += totals[column]
        pixels = number * (min((tile + 1) * TILE, columns) - tile * TILE)
        rough[tile] = np.float32(total) / np.float32(256 * pixels)


@kernel(allocates=True)
def roughness(luminance, columns, offset, rough, half_rough, first, last):
    """
    Measure the second differences along the rows of each tile, at full and at half size.

    A row in four is read, at half size the mean of two. offset: first column that is halved;
    rough, half_rough: float32, by tile, their mean size in grey levels, from noise and texture;
    first, last: rows, from a multiple of 2 TILE on
    """
    half_columns = columns // 2
    totals, line = np.zeros(columns + TILE, np.int32), np.zeros(half_columns + 2, np.uint16)
    for tile_row in range(first // TILE, (last + TILE - 1) // TILE):
        totals[:] = 0
        number = 0
        for row in range(tile_row * TILE, min((tile_row + 1) * TILE, last), BLOCK):
            _add_bends(luminance[row + MARGIN, MARGIN - 1:], columns, totals)
            number += 1
        _mean_of_tiles(totals, number, columns, rough[tile_row])
    for tile_row in range(first // (2 * TILE), (last // 2 + TILE - 1) // TILE):
        totals[:] = 0
        number = 0
        for row in range(tile_row * TILE, min((tile_row + 1) * TILE, last // 2), BLOCK):
            above, below = (luminance[2 * row + MARGIN, MARGIN + offset:],
                            luminance[2 * row + 1 + MARGIN, MARGIN + offset:])
            for column in range(half_columns):
                line[column + 1] = (np.uint32(above[2 * column]) + above[2 * column + 1]
                                    + below[2 * column] + below[2 * column + 1]) >> np.uint32(2)
            line[0], line[half_columns + 1] = line[1], line[half_columns]
            _add_bends(line, half_columns, totals)
            number += 1
        _mean_of_tiles(totals, number, half_columns, half_rough[tile_row])


@called(allocates=True)
def _plainest(rough):
    """Return the noise of a picture by its plainest tiles, grey levels, as if without texture."""
    some = rough.ravel().copy()
    return np.float64(of_rank(some, some.size, int(PLAINEST * (some.size - 1)))) / SECOND


@kernel(allocates=True)
def noise_level(full, half):
    """Return the noise of a picture by its `roughness` at both sizes, grey levels."""
    return np.sqrt(max(_plainest(full)**2 - _plainest(half)**2, 0.0) / LOST)


@kernel(allocates=True)
def blend(picture, before, shifts, tiles, after, first, last):
    """
    Average a picture with the one before, tile by tile, and write a copy of the result.

    picture: luminance, changed with its padding, and grey, uint8 (R, C + slack), luminance / 256;
    after: as before; tiles: choices, new ages, and limits, float32, grey levels: larger
    differences of a pixel count as this one; first, last: tile rows
    """
    (luminance, grey), (choices, ages, limits) = picture, tiles
    rows, columns = before.shape
    weight, limit = np.zeros(columns, np.uint16), np.zeros(columns, np.uint16)
    for tile_row in range(first, last):
        chosen = choices[tile_row]
        for column in range(columns):
            tile = column // TILE
            weight[column] = np.uint16(65536 - 65536 / ages[tile_row, tile])
            limit[column] = np.uint16(256 * min(limits[tile_row, tile], np.float32(255)))
        bottom = min((tile_row + 1) * TILE, rows)
        tile = 0
        while tile < len(chosen):
            choice, run = chosen[tile], tile
            while tile < len(chosen) and chosen[tile] == choice:
                tile += 1
            if choice < 0:
                continue
            down, right = shifts[choice, 0], shifts[choice, 1]
            begin = max(run * TILE, right)
            end = max(min(tile * TILE, columns, columns + right), begin)
            for row in range(max(tile_row * TILE, down), min(bottom, rows + down)):
                _blend_row(luminance[row + MARGIN, begin + MARGIN:end + MARGIN],
                           grey[row, begin:end], before[row - down, begin - right:end - right],
                           weight[begin:end], limit[begin:end])
        for row in range(tile_row * TILE, bottom):
            pad_row(luminance, row, columns, MARGIN)
            copy_row(luminance[row + MARGIN, MARGIN:], after[row])


@called
def _blend_row(here, grey, there, weight, limit):
    """
    Move a row towards that of the picture before, by no more than the limit allows.

    weight: uint16, of the picture before, in 1 / 65536; all in 16 bits, twice as many at once.
    """
    for column in range(len(here)):
        new, old = here[column], there[column]
        higher = max(new, old)
        fall = min(np.uint16(higher - old), limit[column])
        rise = min(np.uint16(higher - new), limit[column])
        fall = np.uint16((np.uint32(fall) * np.uint32(weight[column])) >> np.uint32(16))
        rise = np.uint16((np.uint32(rise) * np.uint32(weight[column])) >> np.uint32(16))
        value = np.uint16(np.uint16(new - fall) + rise)
        here[column] = value
        grey[column] = np.uint8(
            np.uint16(min(value, np.uint16(65407)) + np.uint16(128)) >> np.uint16(8))
