# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Plain twins of what guides the search and of how its chromosomes are measured."""
from fuzzy_stereo_ros.matching.kernels.units import INVALID
import numpy as np
from reference import windows

# ---- what the half map says ----


def weak_texture(grey, limit):
    """Return where the steps between 3 x 2 pairs of pixels along the row sum to < limit."""
    rows, columns = grey.shape[0] // 2, grey.shape[1] // 2
    source = 2 * np.minimum(np.arange(columns), columns - 2)
    first, second, third = (grey[:2 * rows:2, source + k].astype(int) for k in range(3))
    steps = (abs(second - first) + abs(third - second)) * (columns > 1)
    return windows(steps, 1).sum(axis=2) < limit


def flat(labels, most):
    """Return where 3 x 3 labels span at most `most`."""
    return np.ptp(windows(labels.astype(int), 1), axis=2) <= most


def doubled(half, shape):
    """Spread a half-size map over the full image; an odd last row or column repeats."""
    rows = np.minimum(np.arange(shape[0]) // 2, half.shape[0] - 1)
    columns = np.minimum(np.arange(shape[1]) // 2, half.shape[1] - 1)
    return half[rows][:, columns]


# ---- the fitness ----


def gene_costs(volume, chromosome, validity, target, inside, hidden, contradicted):
    """Return what genes cost: their match, or what the target says where there is none."""
    costs = np.zeros(chromosome.shape, np.int64)
    extra = target.shape[1] - chromosome.shape[1]
    for row, column in np.ndindex(chromosome.shape):
        label = int(chromosome[row, column])
        pointed = column - label
        if not inside[0] <= pointed <= inside[1]:
            costs[row, column] = hidden
            continue
        costs[row, column] = volume[row, column, label]
        if validity[row, column] == INVALID:
            nearer = int(target[row, extra + pointed]) - label
            if volume.shape[2] > 255:        # the labels of the target are known modulo 256
                nearer = (nearer + 128) % 256 - 128
            if abs(nearer) > 1:
                costs[row, column] = hidden if nearer > 1 else contradicted
    return costs


def jump_costs(chromosome, small, across, down):
    """Return what the jumps to the left and up cost each gene: int64 (R, C)."""
    genes = chromosome.astype(np.int64)
    costs = np.zeros(genes.shape, np.int64)
    for row, column in np.ndindex(genes.shape):
        for jump, there, other in ((across, column > 0, (row, column - 1)),
                                   (down, row > 0, (row - 1, column))):
            away = abs(genes[row, column] - genes[other]) if there else 0
            costs[row, column] += 0 if away == 0 else small if away == 1 else jump[row, column]
    return costs
