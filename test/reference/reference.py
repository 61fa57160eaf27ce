# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Plain twins of the kernels, one cell at a time, written from the paper and the documentation.

They are slow and meant to be believed at a thumbnail.
"""
import math

import numpy as np

# ---- the paper: grey classes, Eq. 1 to Eq. 4 ----


def membership(intensity, centre, sigma):
    """Return Eq. 1 of one pixel."""
    return math.exp(-(intensity - centre)**2 / (2 * sigma**2))


def matching_possibility(first, second, sigma):
    """Return Eq. 2 of two pixels."""
    black = min(membership(first, 0, sigma), membership(second, 0, sigma))
    average = min(membership(first, 127.5, sigma), membership(second, 127.5, sigma))
    white = min(membership(first, 255, sigma), membership(second, 255, sigma))
    return max(black, average, white)


def target_column(column, index, min_disparity, columns, reference):
    """Return the column of the match in the target image, or None outside of it."""
    disparity = min_disparity + index
    seen = column - disparity if reference == 'left' else column + disparity
    return seen if 0 <= seen < columns else None


def possibility_volume(left, right, disparities, min_disparity, sigma, reference='left'):
    """Return Eq. 2 of every (r, c, d): float64 (R, C, D)."""
    image, target = (left, right) if reference == 'left' else (right, left)
    volume = np.zeros((*left.shape, disparities))
    for row, column, index in np.ndindex(volume.shape):
        seen = target_column(column, index, min_disparity, left.shape[1], reference)
        if seen is not None:
            volume[row, column, index] = matching_possibility(
                int(image[row, column]), int(target[row, seen]), sigma)
    return volume


def chosen_possibility(volume, chromosome):
    """Return what the volume holds for the choices of a chromosome: (R, C)."""
    chosen = np.zeros(chromosome.shape, volume.dtype)
    for row, column in np.ndindex(chromosome.shape):
        chosen[row, column] = volume[row, column, chromosome[row, column]]
    return chosen


def sobel_norm(grey):
    """Return the Sobel gradient norm, whole, with the image mirrored about its border pixels."""
    rows, columns = grey.shape
    across = ((-1, 0, 1), (-2, 0, 2), (-1, 0, 1))
    norm = np.zeros(grey.shape, np.int64)
    for row, column in np.ndindex(grey.shape):
        x = y = 0
        for i, j in np.ndindex(3, 3):
            value = int(grey[_mirrored(row + i - 1, rows), _mirrored(column + j - 1, columns)])
            x += across[i][j] * value
            y += across[j][i] * value
        norm[row, column] = math.floor(math.hypot(x, y) + 0.5)
    return norm


def _mirrored(place, size):
    if size == 1:
        return 0
    return -place if place < 0 else 2 * (size - 1) - place if place >= size else place


def fitness(volume, chromosome, left_norm, right_norm, min_disparity, neighbourhood,
            reference='left'):
    """Return Eq. 3 with the weight of Eq. 4, in the unit of the volume."""
    return sum(row_fitness(volume, chromosome, left_norm, right_norm, min_disparity,
                           neighbourhood, reference))


def row_fitness(volume, chromosome, left_norm, right_norm, min_disparity, neighbourhood,
                reference='left'):
    """Return the inner sums of Eq. 3 for each row: a list of R numbers."""
    rows, columns = chromosome.shape
    own, other = (left_norm, right_norm) if reference == 'left' else (right_norm, left_norm)
    half = neighbourhood // 2
    sums = []
    for r in range(rows):
        total = 0
        for c in range(columns):
            seen = target_column(c, int(chromosome[r, c]), min_disparity, columns, reference)
            if seen is None:
                continue
            significance = own[r, c].item() * other[r, seen].item()
            support = 0
            for i in range(-half, half + 1):
                for j in range(-half, half + 1):
                    if 0 <= r + i < rows and 0 <= c + j < columns:
                        support += volume[r + i, c + j, chromosome[r + i, c + j]].item()
            total += significance * support
        sums.append(total)
    return sums


# ---- chance ----


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
