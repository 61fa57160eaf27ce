# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Compare the tiles of a picture with the previous one, and average the unchanged ones with it.

Differences are taken in 1 / 32 grey level of 8 bits, so that sums of four fit 16 bits.
"""
from typing import NamedTuple

from fuzzy_stereo_ros.matching.kernels.compiled import called, inlined, kernel
from fuzzy_stereo_ros.matching.kernels.possibility.features import MARGIN
from fuzzy_stereo_ros.matching.kernels.rows import copy_row, pad_row
import numpy as np

TILE = 16        # pixels of a side of the tiles that are compared
BLOCK = 4        # pixels of a side of the blocks whose mean differences are compared
DROPPED_BITS = 3    # low bits of luminance that a comparison drops
UNITS = 32       # units of a compared difference in a grey level
# larger slopes and differences of sums of BLOCK rows are cut, bits of products are dropped, to fit
LARGEST_SLOPE, PRODUCT_BITS = 1024, 8
LEAST_VARIED = 0.02     # share of the squares of slopes that is left without their mean
SIZE_OF_NOISE = 0.8     # mean size of white noise of 1


@kernel(allocates=True)
def compare_tiles(now, before, down, right, differences, first, last):
    """
    Measure how tiles of a picture differ from the picture before, moved down and to the right.

    now: uint16 (R + 4, C + 4 + slack), padded; before: uint16 (R, C); differences: float32
    (8, tile rows, tile columns), of which the tile rows first .. last are written:

    0: the mean absolute difference of pixels, grey levels; infinite for tiles that show nothing
    of the picture before
    1: the mean absolute value of the mean differences of blocks, times BLOCK, grey levels; that
    of white noise is as large as the difference of pixels
    2: the largest absolute mean difference of a block, grey levels
    3: the largest mean absolute difference of a block, grey levels
    4: the covariance of differences and slopes along the row, of sums of BLOCK rows, in units of
    its own; its sign is that of a motion, and a change of light leaves it as it is
    5: its variance if all differences are noise
    6: the sum of the squares of the slopes
    7: the mean grey level before
    """
    rows, columns = before.shape
    top, bottom = max(down, 0), rows + min(down, 0)
    begin, end = max(right, 0), columns + min(right, 0)
    signed = np.zeros(columns + 2 * TILE, np.int16)
    sizes = np.zeros_like(signed)
    bright = np.zeros(columns + 2, np.int16)
    of_columns = np.zeros((10, columns + TILE), np.int32)
    for tile_row in range(first, last):
        above, below = max(tile_row * TILE, top), min((tile_row + 1) * TILE, bottom)
        of_columns[:] = 0
        for strip in range(tile_row * TILE, (tile_row + 1) * TILE, BLOCK):
            signed[:] = 0
            sizes[:] = 0
            bright[:] = 0
            for row in range(max(strip, above), min(strip + BLOCK, below)):
                here = now[row + MARGIN, begin + MARGIN:max(begin, end) + MARGIN]
                there = before[row - down, begin - right:max(begin, end) - right]
                _add_differences(here, there, signed[begin:], sizes[begin:])
                _add_brightness(there, bright[begin + 1:])
            if end > begin:
                bright[begin], bright[end + 1] = bright[begin + 1], bright[end]
                _add_products(signed[begin:end], bright[begin:], of_columns[4, begin:],
                              of_columns[5, begin:])
                _add_slopes(signed[begin:end], bright[begin:], of_columns[6, begin:],
                            of_columns[7, begin:], of_columns[8, begin:])
                _add_columns(bright[begin + 1:end + 1], of_columns[9, begin:])
            _add_blocks(sizes, of_columns[0], of_columns[3])
            _add_blocks(signed, of_columns[1], of_columns[2])
        _sum_up(of_columns, max(below - above, 0), begin, end, differences[:, tile_row])


@called
def _add_differences(here, there, signed, sizes):
    """Add the differences of two rows, and their sizes, in 1 / UNITS grey level."""
    for column in range(len(here)):
        difference = np.int16(np.int16(here[column] >> np.uint16(DROPPED_BITS))
                              - np.int16(there[column] >> np.uint16(DROPPED_BITS)))
        signed[column] += difference
        sizes[column] += np.int16(abs(difference))


@called
def _add_brightness(line, sums):
    """Add a row of grey levels, in 1 / UNITS: sums of BLOCK rows fit 16 bits."""
    for column in range(len(line)):
        sums[column] += np.int16(line[column] >> np.uint16(DROPPED_BITS))


@called
def _add_products(signed, bright, products, variances):
    """Add differences times slopes and their squares, by column."""
    for column in range(len(signed)):
        product = (_slope(bright, column) * _cut(signed[column])) >> np.int32(PRODUCT_BITS)
        products[column] += product
        variances[column] += product * product


@inlined
def _cut(value):
    """Return a value, at most as large as the steepest slope."""
    return min(max(np.int32(value), np.int32(-LARGEST_SLOPE)), np.int32(LARGEST_SLOPE))


@inlined
def _slope(bright, column):
    """Return the slope at a column of grey levels that begin a column before."""
    return _cut(np.int32(bright[column + 2]) - np.int32(bright[column]))


@called
def _add_slopes(signed, bright, differences, slopes, squares):
    """Add differences, slopes and the squares of slopes, by column."""
    for column in range(len(signed)):
        slope = _slope(bright, column)
        differences[column] += _cut(signed[column])
        slopes[column] += slope
        squares[column] += slope * slope


@called
def _add_columns(line, sums):
    """Add a line of sums of BLOCK rows."""
    for column in range(len(line)):
        sums[column] += np.int32(line[column])


@called
def _add_blocks(line, totals, largest):
    """
    Add the sums of the BLOCK columns from each column on; only every BLOCK-th is read.

    Few arrays at once: the compiler tests each pair for overlap before it uses vectors.
    """
    for column in range(len(totals)):
        block = np.int32(abs(np.int32(line[column]) + np.int32(line[column + 1])
                             + np.int32(line[column + 2]) + np.int32(line[column + 3])))
        totals[column] += block
        largest[column] = max(largest[column], block)


@called
def _sum_up(of_columns, height, begin, end, found):
    """Write `differences` of a row of tiles, `height` rows of which the picture before shows."""
    unit = np.float32(1 / UNITS)
    for tile in range(found.shape[1]):
        left = tile * TILE
        total = of_blocks = peak = bump = 0
        motion = variance = total_difference = total_slope = steepness = brightness = 0
        for column in range(left, left + TILE):
            motion += of_columns[4, column]
            variance += of_columns[5, column]
            total_difference += of_columns[6, column]
            total_slope += of_columns[7, column]
            steepness += of_columns[8, column]
            brightness += of_columns[9, column]
        for column in range(left, left + TILE, BLOCK):
            total += of_columns[0, column]
            of_blocks += of_columns[1, column]
            peak = max(peak, of_columns[2, column])
            bump = max(bump, of_columns[3, column])
        number = height * max(min(left + TILE, end) - max(left, begin), 0)
        found[0, tile] = total * unit / np.float32(number) if number > 0 else np.inf
        found[1, tile] = of_blocks * unit * np.float32(BLOCK) / np.float32(max(number, 1))
        found[2, tile] = peak * unit / np.float32(BLOCK * BLOCK)
        found[3, tile] = bump * unit / np.float32(BLOCK * BLOCK)
        mean_slope = np.float32(total_slope) / np.float32(max(number // BLOCK, 1))
        varies = np.float32(1) - mean_slope * np.float32(total_slope) / np.float32(
            max(steepness, 1))
        varies = varies if varies > np.float32(LEAST_VARIED) else np.float32(0)
        found[4, tile] = (np.float32(motion) - mean_slope * np.float32(total_difference)
                          / np.float32(1 << PRODUCT_BITS)) if varies > 0 else np.float32(0)
        found[5, tile] = np.float32(variance) * varies
        found[6, tile] = np.float32(steepness)
        found[7, tile] = brightness * unit / np.float32(max(number, 1))


@kernel(allocates=True)
def roughness(luminance, columns, rough, first, last):
    """
    Measure the second differences along the rows of each tile; a row in four is read.

    luminance: uint16, padded; rough: float32 (tile rows, tile columns), their mean size in grey
    levels, from noise and texture.
    """
    rows = luminance.shape[0] - 2 * MARGIN
    totals = np.zeros(columns + TILE, np.int32)
    for tile_row in range(first, last):
        totals[:] = 0
        bottom = min((tile_row + 1) * TILE, rows)
        for row in range(tile_row * TILE, bottom, BLOCK):
            left, here = luminance[row + MARGIN, MARGIN - 1:], luminance[row + MARGIN, MARGIN:]
            right = luminance[row + MARGIN, MARGIN + 1:]
            for column in range(columns):
                totals[column] += abs(2 * np.int32(here[column]) - np.int32(left[column])
                                      - np.int32(right[column]))
        read = (bottom - tile_row * TILE + BLOCK - 1) // BLOCK
        for tile in range(rough.shape[1]):
            total = 0
            for column in range(tile * TILE, (tile + 1) * TILE):
                total += totals[column]
            number = read * (min((tile + 1) * TILE, columns) - tile * TILE)
            rough[tile_row, tile] = np.float32(total) / np.float32(256 * number)


class AveragedTiles(NamedTuple):
    """How the tiles of a picture are averaged with the one before: (tile rows, tile columns)."""

    choices: np.ndarray  # int8, index of the tile's shift, < 0 where it is not averaged
    ages: np.ndarray     # float32, number of frames in the new average
    limits: np.ndarray   # float32, grey levels: larger differences of a pixel count as this one


@kernel(allocates=True)
def blend(picture, before, shifts, tiles, after, first, last):
    """
    Average a picture with the one before, tile by tile, and write a copy of the result.

    picture: luminance, uint16, padded, changed with its padding, and grey, uint8 (R, C + slack),
    luminance / 256; before, after: uint16 (R, C); shifts: int64 (N, 2), down and right; tiles: the
    fields of AveragedTiles.
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
