# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Plain twins of what guides the search and of how its chromosomes are measured."""
import numpy as np
from reference_refinement import INVALID

# ---- what the half map says ----


def weak_texture(grey, limit):
    """Return where the steps between 3 x 2 pairs of pixels along the row sum to < limit."""
    rows, columns = grey.shape[0] // 2, grey.shape[1] // 2
    steps = np.zeros((rows, columns), np.int64)
    for row, column in np.ndindex(steps.shape):
        source = min(column, columns - 2)
        if source >= 0:
            first, second, third = (int(grey[2 * row, 2 * source + k]) for k in range(3))
            steps[row, column] = abs(second - first) + abs(third - second)
    around = np.pad(steps, 1, 'edge')
    return sum(around[down:down + rows, right:right + columns]
               for down, right in np.ndindex(3, 3)) < limit


def flat(labels, most):
    """Return where 3 x 3 labels span at most `most`."""
    around = np.pad(labels.astype(np.int64), 1, 'edge')
    rows, columns = labels.shape
    near = [around[down:down + rows, right:right + columns] for down, right in np.ndindex(3, 3)]
    return np.max(near, axis=0) - np.min(near, axis=0) <= most


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
            if volume.shape[2] > 256:        # the target's labels are known modulo 256
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
