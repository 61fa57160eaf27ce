# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Plain twins of the kernels, one cell at a time, written from the paper and the documentation."""
# They are slow and meant to be believed at a thumbnail.
import math

import numpy as np


def membership(intensity, centre, sigma):
    """Return Eq. 1 of one pixel."""
    return math.exp(-(intensity - centre)**2 / (2 * sigma**2))


def matching_possibility(first, second, sigma):
    """Return Eq. 2 of two pixels."""
    black = min(membership(first, 0, sigma), membership(second, 0, sigma))
    average = min(membership(first, 127.5, sigma), membership(second, 127.5, sigma))
    white = min(membership(first, 255, sigma), membership(second, 255, sigma))
    return max(black, average, white)


def target_column(column, index, min_disparity, columns):
    """Return the column of the match in the right image, or None outside of it."""
    seen = column - min_disparity - index
    return seen if 0 <= seen < columns else None


def possibility_volume(left, right, disparities, min_disparity, sigma):
    """Return Eq. 2 of every (r, c, d): float64 (R, C, D)."""
    volume = np.zeros((*left.shape, disparities))
    for row, column, index in np.ndindex(volume.shape):
        seen = target_column(column, index, min_disparity, left.shape[1])
        if seen is not None:
            volume[row, column, index] = matching_possibility(
                int(left[row, column]), int(right[row, seen]), sigma)
    return volume


def chosen_possibility(volume, chromosome):
    """Return what the volume holds for the choices of a chromosome: (R, C)."""
    return np.take_along_axis(volume, chromosome[..., np.newaxis].astype(np.int64), axis=2)[..., 0]


def mirrored_around(values, width):
    """Return an array (R, C) with its pixels mirrored about those of the border around it."""
    for axis, size in enumerate(values.shape):
        margin = [(0, 0), (0, 0)]
        margin[axis] = width, width
        values = np.pad(values, margin, 'reflect' if size > 1 else 'edge')
    return values


def sobel_norm(grey):
    """Return the Sobel gradient norm, whole, with the image mirrored about its border pixels."""
    around = mirrored_around(grey.astype(np.int64), 1)
    norm = np.zeros(grey.shape, np.int64)
    for row, column in np.ndindex(grey.shape):
        window = around[row:row + 3, column:column + 3]
        x, y = ((each * ((-1, 0, 1), (-2, 0, 2), (-1, 0, 1))).sum() for each in (window, window.T))
        norm[row, column] = math.floor(math.hypot(x, y) + 0.5)
    return norm


def fitness(volume, chromosome, left_norm, right_norm, min_disparity, neighbourhood):
    """Return Eq. 3 with the weight of Eq. 4, in the unit of the volume."""
    return sum(row_fitness(
        volume, chromosome, left_norm, right_norm, min_disparity, neighbourhood))


def row_fitness(volume, chromosome, left_norm, right_norm, min_disparity, neighbourhood):
    """Return the inner sums of Eq. 3 for each row: a list of R numbers."""
    rows, columns = chromosome.shape
    half = neighbourhood // 2
    chosen = chosen_possibility(volume, chromosome)
    sums = [0] * rows
    for row, column in np.ndindex(rows, columns):
        seen = target_column(column, int(chromosome[row, column]), min_disparity, columns)
        if seen is not None:
            support = chosen[max(row - half, 0):row + half + 1,
                             max(column - half, 0):column + half + 1].sum().item()
            sums[row] += left_norm[row, column].item() * right_norm[row, seen].item() * support
    return sums


# ---- random numbers ----


def mixed(key, counter):
    """Return one step of SplitMix64 (Steele, Lea and Flood) in Python's whole numbers."""
    mask = 2**64 - 1
    bits = (key + (counter + 1) * 0x9E3779B97F4A7C15) & mask
    bits = ((bits ^ (bits >> 30)) * 0xBF58476D1CE4E5B9) & mask
    bits = ((bits ^ (bits >> 27)) * 0x94D049BB133111EB) & mask
    return bits ^ (bits >> 31)


def random_genes(key, disparities, rows, columns):
    """Return a random chromosome: uint16 (R, C)."""
    genes = [(mixed(key, place) >> 32) * disparities >> 32 for place in range(rows * columns)]
    return np.array(genes, np.uint16).reshape(rows, columns)


# ---- the paper: mutation ----


def least_possible_cells(chosen, share):
    """Return how many of the `share` least possible cells have each possibility: 256 numbers."""
    cells = [0.0] * 256
    wanted = share * chosen.size
    for value in sorted(chosen.ravel().tolist()):
        cells[value] += min(wanted, 1.0)
        wanted -= min(wanted, 1.0)
    return cells


def thrown_patches(key, patches, neighbourhood, disparities, chosen, level, share_of_ties,
                   chromosome):
    """Return a chromosome with patches on its least possible cells."""
    rows, columns = chosen.shape
    half = neighbourhood // 2
    mutant = chromosome.copy()
    for patch in range(patches):
        place, tie, gene = (mixed(key, 3 * patch + step) for step in range(3))
        # The patches go down the image, each at a random place of its own share of the rows.
        row = int((patch + (place >> 11) / 2**53) * rows / patches)
        column = (place & 0xFFFFFFFF) * columns >> 32
        value = chosen[row, column]
        if value > level or (value == level and (tie >> 11) / 2**53 >= share_of_ties):
            continue
        for r in range(rows):
            for c in range(columns):
                if abs(r - row) <= half and abs(c - column) <= half:
                    mutant[r, c] = (gene >> 32) * disparities >> 32
    return mutant


# ---- plain twins of the fitness of the uniform reading, one cell at a time ----


AROUND = [(0, -1), (-1, -1), (-1, 0), (-1, 1), (0, 1), (1, 1), (1, 0), (1, -1)]
SMOOTH = {0: 8, 1: 7}


def cell_fitness(genes, chosen, weights):
    """Return possibility times smoothness of each cell: int64 (R, C)."""
    # genes, chosen: (R, C); weights: (8, R, C)
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
