# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the half-size chromosome tells the full one: where to search, where to lean on it."""
from fuzzy_stereo_ros.matching.kernels.consistency import REFUSED
from fuzzy_stereo_ros.matching.kernels.simd import LANES
from numba import njit
import numpy as np


@njit(nogil=True, cache=True)
def tile_windows(half, previous, trusted, disparities, tile, grow, margin, low, blocks):
    """
    Find the labels that each tile searches: those of the half map around it, and a margin.

    half: (r, c) labels at half size; previous, trusted: (R, C), labels that must be inside where
    trusted > 0; tile, grow: pixels of the full image, even; low, blocks: int64 (tile rows, tile
    columns), first label and number of blocks of 32.
    """
    rows, columns = half.shape
    most = (disparities + LANES - 1) // LANES
    for tile_row in range(low.shape[0]):
        for tile_column in range(low.shape[1]):
            least, largest = disparities, 0
            top, left = tile_row * tile, tile_column * tile
            for row in range(max(top - grow, 0) // 2, min((top + tile + grow) // 2, rows)):
                for column in range(max(left - grow, 0) // 2,
                                    min((left + tile + grow) // 2, columns)):
                    label = np.int64(half[row, column])
                    least, largest = min(least, 2 * label), max(largest, 2 * label + 1)
            for row in range(top, min(top + tile, trusted.shape[0]), 2):
                for column in range(left, min(left + tile, trusted.shape[1]), 2):
                    if trusted[row, column] > 0:
                        label = np.int64(previous[row, column])
                        least, largest = min(least, label), max(largest, label)
            if largest < least:
                least, largest = 0, disparities - 1
            least, largest = max(least - margin, 0), min(largest + margin, disparities - 1)
            number = min((largest - least + LANES) // LANES, most)
            spare = LANES * number - (largest - least + 1)
            first = min(least - spare // 2, disparities - LANES * number)
            low[tile_row, tile_column] = max(first, 0)
            blocks[tile_row, tile_column] = number


@njit(nogil=True, cache=True)
def weak_texture(grey, rows, columns, limit, steps, weak):
    """
    Mark the half pixels around which the full image has little texture.

    grey: uint8 (R, C + slack) at full size; steps: uint16 (r, c), working memory; weak: uint8
    (r, c), 1 where the steps along the row of 6 x 3 pixels sum to less than `limit`.
    """
    for row in range(rows):
        for column in range(columns - 1):
            here = np.int16(grey[2 * row, 2 * column + 1])
            steps[row, column] = (abs(here - np.int16(grey[2 * row, 2 * column]))
                                  + abs(np.int16(grey[2 * row, 2 * column + 2]) - here))
        steps[row, columns - 1] = steps[row, max(columns - 2, 0)]
    for row in range(rows):
        above, below = max(row - 1, 0), min(row + 1, rows - 1)
        for column in range(columns):
            left, right = max(column - 1, 0), min(column + 1, columns - 1)
            total = (steps[above, left] + steps[above, column] + steps[above, right]
                     + steps[row, left] + steps[row, column] + steps[row, right]
                     + steps[below, left] + steps[below, column] + steps[below, right])
            weak[row, column] = total < limit


@njit(nogil=True, cache=True)
def flat(labels, most, smooth):
    """Mark the pixels whose 3 x 3 labels span at most `most`: uint8 (r, c)."""
    rows, columns = labels.shape
    for row in range(rows):
        above, here, below = labels[max(row - 1, 0)], labels[row], labels[min(row + 1, rows - 1)]
        for column in range(columns):
            left, right = max(column - 1, 0), min(column + 1, columns - 1)
            least = min(above[left], above[column], above[right], here[left], here[column],
                        here[right], below[left], below[column], below[right])
            largest = max(above[left], above[column], above[right], here[left], here[column],
                          here[right], below[left], below[column], below[right])
            smooth[row, column] = largest - least <= most


@njit(nogil=True, cache=True)
def lean_on_half(half, verdict, weak, smooth, labels, weights):
    """
    Spread the half map, doubled, as a prior: weight 1 where it can be leant on, else 0.

    half, verdict, weak, smooth: (r, c); labels, weights: (R, C), R in (2 r, 2 r + 1).
    """
    rows, columns = half.shape
    for row in range(labels.shape[0]):
        source = min(row // 2, rows - 1)
        for column in range(labels.shape[1]):
            near = min(column // 2, columns - 1)
            labels[row, column] = 2 * np.int64(half[source, near])
            weights[row, column] = (weak[source, near] & smooth[source, near]
                                    & (verdict[source, near] != REFUSED))
