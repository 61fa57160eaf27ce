# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Pictures moved towards the pictures before, tile by tile."""
from fuzzy_stereo_ros.matching.kernels.compiled import kernel
from fuzzy_stereo_ros.matching.kernels.possibility.features import copy_row, MARGIN, pad_row
from fuzzy_stereo_ros.matching.kernels.temporal.change_detection import TILE
import numpy as np


@kernel
def blend(fine, grey, before, shifts, choices, ages, limits, after, first, last):
    """
    Move a picture towards the one before, tile by tile, and keep a copy.

    fine: uint16, padded, the padding follows; grey: uint8 (R, C + slack), fine / 256; before,
    after: uint16 (R, C); shifts: int64 (N, 2), down and right; choices: int8 (tile rows, tile
    columns), the shift of a tile, < 0 where it stays as it is; ages: float32 by tile, of how many
    frames it is to be the mean; limits: float32 by tile, grey levels: a pixel is moved as one
    that differs by no more.
    """
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
                _blend_row(fine[row + MARGIN, begin + MARGIN:end + MARGIN], grey[row, begin:end],
                           before[row - down, begin - right:end - right], weight[begin:end],
                           limit[begin:end])
        for row in range(tile_row * TILE, bottom):
            pad_row(fine, row, columns)
            copy_row(fine[row + MARGIN, MARGIN:], after[row])


@kernel
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
