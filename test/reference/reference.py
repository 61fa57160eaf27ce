# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Plain twins of the kernels, one cell at a time, written from the paper and the documentation."""
# They are slow and meant to be believed at a thumbnail.
import math

import numpy as np


def membership(intensity, centre, sigma):
    """Return Eq. 1 of one pixel."""
    return math.exp(-(intensity - centre)**2 / (2 * sigma**2))


def target_column(column, index, min_disparity, columns):
    """Return the column of the match in the right image, or None outside of it."""
    seen = column - min_disparity - index
    return seen if 0 <= seen < columns else None


def possibility_volume(left, right, disparities, min_disparity, sigma):
    """Return Eq. 2 of every (r, c, d), by black, average and white: float64 (R, C, D)."""
    volume = np.zeros((*left.shape, disparities))
    for row, column, index in np.ndindex(volume.shape):
        seen = target_column(column, index, min_disparity, left.shape[1])
        if seen is not None:
            levels = int(left[row, column]), int(right[row, seen])
            volume[row, column, index] = max(
                min(membership(level, centre, sigma) for level in levels)
                for centre in (0, 127.5, 255))
    return volume


def windows(values, reach, **padding):
    """Return the pixels of the square around each one, row by row, borders repeated: (R, C, n)."""
    around = np.pad(values, reach, **(padding or {'mode': 'edge'}))
    return np.lib.stride_tricks.sliding_window_view(
        around, 2 * (2 * reach + 1,)).reshape(*values.shape, -1)


def sobel_norm(grey):
    """Return the Sobel gradient norm, whole, with the image mirrored about its border pixels."""
    around, across = windows(grey.astype(np.int64), 1, mode='reflect'), np.outer(
        (1, 2, 1), (-1, 0, 1))
    norm = np.hypot(around @ across.ravel(), around @ across.T.ravel())
    return np.floor(norm + 0.5).astype(np.int64)


def fitness(volume, chromosome, left_norm, right_norm, min_disparity, neighbourhood):
    """Return Eq. 3 with the weight of Eq. 4, in the unit of the volume."""
    half, total = neighbourhood // 2, 0
    chosen = np.take_along_axis(volume, chromosome[..., np.newaxis].astype(np.int64), axis=2)
    for row, column in np.ndindex(chromosome.shape):
        seen = target_column(
            column, int(chromosome[row, column]), min_disparity, chromosome.shape[1])
        if seen is not None:
            support = chosen[max(row - half, 0):row + half + 1,
                             max(column - half, 0):column + half + 1].sum().item()
            total += left_norm[row, column].item() * right_norm[row, seen].item() * support
    return total


# ---- random numbers ----


def mixed(key, counter):
    """Return one step of SplitMix64 (Steele, Lea and Flood) in Python's whole numbers."""
    mask = 2**64 - 1
    bits = (key + (counter + 1) * 0x9E3779B97F4A7C15) & mask
    bits = ((bits ^ (bits >> 30)) * 0xBF58476D1CE4E5B9) & mask
    bits = ((bits ^ (bits >> 27)) * 0x94D049BB133111EB) & mask
    return bits ^ (bits >> 31)


def random_genes(key, disparities, share, chromosome):
    """Return a chromosome of whose genes a share is drawn anew."""
    genes = chromosome.copy()
    for place in range(genes.size):
        bits = mixed(key, place)
        if bits & 0xFFFFFFFF < math.ceil(share * 2**32):
            genes.flat[place] = (bits >> 32) * disparities >> 32
    return genes


# ---- the paper: mutation ----


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
        mutant[max(row - half, 0):row + half + 1, max(column - half, 0):column + half + 1] = (
            (gene >> 32) * disparities >> 32)
    return mutant


# ---- plain twins of the fitness of the uniform reading, one cell at a time ----


AROUND = [(0, -1), (-1, -1), (-1, 0), (-1, 1), (0, 1), (1, 1), (1, 0), (1, -1)]


def cell_fitness(genes, chosen, weights):
    """Return possibility times smoothness of each cell: int64 (R, C)."""
    # genes, chosen: (R, C); weights: (8, R, C)
    smooth = np.zeros(genes.shape, np.int64)
    around = np.pad(genes.astype(np.int64), 1, constant_values=2**16)
    rows, columns = genes.shape
    for weight, (down, right) in zip(weights.astype(int), AROUND):
        step = abs(genes - around[1 + down:, 1 + right:][:rows, :columns])
        smooth += weight * np.where(step == 0, 8, np.where(step == 1, 7, 0))
    return chosen * smooth
