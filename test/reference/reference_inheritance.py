# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Plain twins of the kernels that move a population, a cell at a time."""
import numpy as np


def origins_of_tiles(choices, down, right, shape):
    """Return where each cell was: row * C + column, -1 where it was not seen."""
    origins = np.full(shape, -1)
    for row, column in np.ndindex(shape):
        choice = choices[row // 16, column // 16]
        then = (row, column) if choice == 0 else (row - down, column - right)
        if choice >= 0 and 0 <= then[0] < shape[0] and 0 <= then[1] < shape[1]:
            origins[row, column] = np.ravel_multi_index(then, shape)
    return origins


def inherit(before, origins, lowest, scale, highest, fresh):
    """Return the genes of cells by those of where they were."""
    genes = fresh.copy()
    for place in np.ndindex(origins.shape):
        if origins[place] >= 0:
            row, column = np.unravel_index(origins[place], origins.shape)
            disparity = float(before[row, column]) + lowest
            nearer = max(np.dot(scale, (column, row, 1, disparity)), 0.05)
            moved = disparity / nearer - lowest
            whole = genes.dtype != np.float32
            genes[place] = np.clip(np.floor(moved + 0.5) if whole else moved, 0, highest)
    return genes
