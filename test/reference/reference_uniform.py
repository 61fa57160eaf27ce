# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Plain twins of the fitness of the uniform reading, one cell at a time."""
import numpy as np

AROUND = [(0, -1), (-1, -1), (-1, 0), (-1, 1), (0, 1), (1, 1), (1, 0), (1, -1)]
SMOOTH = {0: 8, 1: 7}


def cell_fitness(genes, chosen, weights):
    """
    Return possibility times smoothness of each cell: int64 (R, C).

    genes, chosen: (R, C); weights: (8, R, C)
    """
    rows, columns = genes.shape
    found = np.zeros((rows, columns), np.int64)
    for row, column in np.ndindex(rows, columns):
        smooth = 0
        for weight, (down, right) in zip(weights[:, row, column], AROUND):
            if 0 <= row + down < rows and 0 <= column + right < columns:
                step = abs(int(genes[row, column]) - int(genes[row + down, column + right]))
                smooth += int(weight) * SMOOTH.get(step, 0)
        found[row, column] = int(chosen[row, column]) * smooth
    return found


def chosen_of(planes, genes):
    """Return how possible the match is that a chromosome chose: planes (D, R, C), genes (R, C)."""
    return np.take_along_axis(planes, genes[np.newaxis].astype(np.int64), axis=0)[0]
