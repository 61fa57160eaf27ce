# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Chromosomes of labels that a frame inherits: each cell takes the gene of where it was."""
from fuzzy_stereo_ros.matching.kernels.compiled import kernel
from fuzzy_stereo_ros.matching.kernels.temporal.change_detection import TILE
from fuzzy_stereo_ros.matching.kernels.temporal.warp import BEHIND
import numpy as np

NEW = -1        # origin of a cell that the previous frame did not show


@kernel
def origins_of_tiles(choices, down, right, origins):
    """
    Write where each cell was, row * columns + column, or NEW.

    choices: int8 (tile rows, tile columns), 0 where a tile stayed, 1 where it moved down and to
    the right, below 0 where it changed; origins: int32 (R, C)
    """
    rows, columns = origins.shape
    for row in range(rows):
        for column in range(columns):
            choice = choices[row // TILE, column // TILE]
            then = row - down if choice > 0 else row
            place = column - right if choice > 0 else column
            inside = choice >= 0 and 0 <= then < rows and 0 <= place < columns
            origins[row, column] = then * columns + place if inside else NEW


@kernel
def inherit(before, origins, lowest, scale, highest, rounding, fresh, genes):
    """
    Write a chromosome: the genes of the previous one where they were, new ones elsewhere.

    before: uint16 or float32 (R, C); origins: int32 (R, C); lowest: px, the disparity of gene 0;
    scale: (a, b, c, d), the disparity of a point becomes that by a * column + b * row + c + d *
    disparity; highest: the last gene; rounding: is added to genes; fresh: (R, C), genes of NEW
    cells; genes: (R, C), written; both of the type of `before`
    """
    rows, columns = origins.shape
    across, down, constant, by_disparity = scale
    flat = before.reshape(-1)
    for row in range(rows):
        for column in range(columns):
            origin = np.int64(origins[row, column])
            if origin < 0:
                genes[row, column] = fresh[row, column]
                continue
            gene = flat[origin]
            disparity = np.float64(gene) + lowest
            distance = (across * (origin % columns) + down * (origin // columns) + constant
                        + by_disparity * disparity)
            moved = disparity / max(distance, BEHIND) - lowest
            genes[row, column] = min(max(moved + rounding, 0.0), highest)
