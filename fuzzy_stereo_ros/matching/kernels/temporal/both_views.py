# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Compare the changes in both views of a pair, matched by the disparities of the previous frame.

Noise is independent in both views, while moving texture changes both in the same way. An object
that comes nearer may stay in place in one of the views.
"""
from typing import NamedTuple

from fuzzy_stereo_ros.matching.kernels.compiled import inlined, kernel
from fuzzy_stereo_ros.matching.kernels.possibility.features import MARGIN
from fuzzy_stereo_ros.matching.kernels.temporal.change_detection import (
    BLOCK, SIZE, SIZE_OF_NOISE, STEEPNESS, TILE, UNITS)
import numpy as np

FAINTER, STRONGER = 0.4, 1.5    # contrast of texture that moved, as a factor of its differences
SLOPE_CUT = 8.0     # grey levels that contrast reaches at least in strong texture: slopes are cut
LEAST_COMPARED = 3 * TILE**2 // (4 * BLOCK)     # pixels; noise of fewer may correlate by chance
LOW_BITS = 5        # of luminance that are dropped, so that sums of products fit


class ComparedTiles(NamedTuple):
    """The tiles of a view, compared with its previous picture by each of N shifts."""

    shifts: np.ndarray       # int64 (N, 2), down and right
    differences: np.ndarray  # float32 (N, MEASURES, ...) by tile, see compare_tiles
    choices: np.ndarray      # int8 (tile rows, tile columns), the shift of a tile, < 0: none


@inlined
def _may_be_texture(size, steepness):
    """Return whether a tile that differs by a mean size may show texture that moved."""
    deviation = size / np.float32(SIZE_OF_NOISE)
    # of white noise, the variance of slopes of BLOCK rows is that of 2 BLOCK pixels
    contrast = np.float32(np.sqrt(steepness / np.float32(2 * TILE**2)) / np.float32(UNITS))
    return (contrast >= np.float32(FAINTER) * min(deviation, np.float32(SLOPE_CUT))
            and contrast <= np.float32(STRONGER) * deviation)


@kernel
def changes_alike(views, before, labels, offset, compared, alike, first, last):
    """
    Correlate how the points of tiles changed in both views; a row in BLOCK is read.

    Only tiles in which texture may have moved are read: they differ by about their contrast.
    views: left and right, uint16, padded, luminance, the right one mirrored; before: uint16
    (2, R, C), the pictures before; labels: (R, C), of the left picture before; offset: of
    disparities from labels, px; compared: the fields of ComparedTiles, of the left view; alike:
    float32 (tile rows, tile columns), -1 to 1, 0 where less than LEAST_COMPARED pixels are
    compared; the tile rows first .. last are written.
    """
    (left, right), (shifts, differences, choices) = views, compared
    rows, columns = labels.shape
    left_before, right_before = before[0], before[1]
    for tile_row in range(first, last):
        for tile in range(choices.shape[1]):
            choice = choices[tile_row, tile]
            alike[tile_row, tile] = 0
            if choice < 0 or not _may_be_texture(differences[choice, SIZE, tile_row, tile],
                                                 differences[choice, STEEPNESS, tile_row, tile]):
                continue
            down, across = shifts[choice, 0], shifts[choice, 1]
            top, bottom = tile_row * TILE, min((tile_row + 1) * TILE, rows, rows + down)
            begin = max(tile * TILE, across)
            end = min((tile + 1) * TILE, columns, columns + across)
            # columns of the mirrored right picture that both frames show
            low, high = max(-across, 0), columns - max(across, 0)
            products = squares = others = number = 0
            for row in range(top, bottom, BLOCK):
                if row < down:
                    continue
                for column in range(begin, end):
                    source = column - across
                    there = (columns - 1 - column + offset
                             + np.int64(labels[row - down, source]))
                    if low <= there < high:
                        one = (np.int64(left[row + MARGIN, column + MARGIN])
                               - np.int64(left_before[row - down, source])) >> LOW_BITS
                        other = (np.int64(right[row + MARGIN, there + MARGIN])
                                 - np.int64(right_before[row - down, there + across])
                                 ) >> LOW_BITS
                        number += 1
                        products += one * other
                        squares += one * one
                        others += other * other
            size = np.float64(squares) * np.float64(others)
            alike[tile_row, tile] = (
                products / max(size, 1.0)**0.5 if number >= LEAST_COMPARED else 0)


@kernel
def reject_pointed_at(moves, labels, offset, choices, ages):
    """
    Reject the tiles of the right view that pixels of rejected tiles of the left view point at.

    moves: bool (tile rows, tile columns), of the left view; labels, offset: as in
    changes_alike; choices, ages: of the right view, mirrored, changed; a pixel in BLOCK x BLOCK
    is read.
    """
    rows, columns = labels.shape
    for tile_row in range(moves.shape[0]):
        for tile in range(moves.shape[1]):
            if not moves[tile_row, tile]:
                continue
            for row in range(tile_row * TILE, min((tile_row + 1) * TILE, rows), BLOCK):
                for column in range(tile * TILE, min((tile + 1) * TILE, columns), BLOCK):
                    there = columns - 1 - column + np.int64(labels[row, column]) + offset
                    if 0 <= there < columns:
                        choices[tile_row, there // TILE], ages[tile_row, there // TILE] = -1, 1


@kernel
def ages_of_both(ages, labels, offset, shifts, choices, found):
    """
    Write for each tile of the left view its age, or that of its match in the right view if less.

    The age of the match is the harmonic mean over the matched tiles, as noise falls with 1 / age.
    ages: float32 (2, tile rows, tile columns), those of the right view mirrored; labels to
    choices: as in changes_alike; found: float32 (tile rows, tile columns); a pixel in BLOCK x
    BLOCK is read.
    """
    rows, columns = labels.shape
    for tile_row in range(choices.shape[0]):
        for tile in range(choices.shape[1]):
            choice, number, noise = choices[tile_row, tile], 0, np.float32(0)
            down, across = (shifts[choice, 0], shifts[choice, 1]) if choice > 0 else (0, 0)
            for row in range(max(tile_row * TILE, down),
                             min((tile_row + 1) * TILE, rows, rows + down), BLOCK):
                for column in range(max(tile * TILE, across),
                                    min((tile + 1) * TILE, columns, columns + across), BLOCK):
                    target = column - np.int64(labels[row - down, column - across]) - offset
                    mirrored = columns - 1 - target
                    if 0 <= mirrored < columns:
                        number += 1
                        noise += np.float32(1) / ages[1, tile_row, mirrored // TILE]
            age = ages[0, tile_row, tile]
            found[tile_row, tile] = age if number == 0 else min(
                age, np.float32(number) / noise)
