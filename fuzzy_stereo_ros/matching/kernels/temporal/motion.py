# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""How the picture moved as a whole; the previous best, and where it is still trusted."""
from fuzzy_stereo_ros.matching.kernels.compiled import called, kernel
from fuzzy_stereo_ros.matching.kernels.possibility.features import MARGIN
from fuzzy_stereo_ros.matching.kernels.rows import copy_row
from fuzzy_stereo_ros.matching.kernels.temporal.change_detection import TILE
from fuzzy_stereo_ros.matching.kernels.units import CONSISTENT
import numpy as np


@kernel(allocates=True)
def thumbnail(luminance, margin, size, small):
    """Write the means of squares of size x size pixels of luminance inside a margin."""
    columns = small.shape[1] * size
    sums = np.zeros(columns, np.uint32)
    for row in range(small.shape[0]):
        sums[:] = 0
        for near in range(row * size, (row + 1) * size):
            line = luminance[near + margin, margin:columns + margin]
            for column in range(columns):
                sums[column] += line[column]
        for column in range(small.shape[1]):
            total = 0
            for near in range(column * size, (column + 1) * size):
                total += sums[near]
            small[row, column] = np.float32(total) / np.float32(size * size)


@kernel
def best_shift(now, before, down, right, reach, every):
    """
    Return the shift, at most `reach` from a known one in both directions, that fits best.

    Every `every`-th row is read. Among equally good shifts the known one is preferred, then the
    first.
    """
    best, least = (down, right), _mismatch(now, before, down, right, every)
    for more_down in range(-reach, reach + 1):
        for more_right in range(-reach, reach + 1):
            found = _mismatch(now, before, down + more_down, right + more_right, every)
            if found < least:
                best, least = (down + more_down, right + more_right), found
    return best


@called
def _mismatch(now, before, down, right, every):
    """Return the mean difference of a picture and the one before, moved."""
    rows, columns = before.shape
    begin, end = max(right, 0), columns + min(right, 0)
    total = number = 0
    for row in range(max(down, 0), rows + min(down, 0), every):
        here = now[row + MARGIN, begin + MARGIN:max(begin, end) + MARGIN]
        there = before[row - down, begin - right:max(begin, end) - right]
        of_row = np.int32(0)
        for column in range(len(here)):
            of_row += abs(np.int32(here[column]) - np.int32(there[column]))
        total += of_row
        number += len(here)
    return total / number if number > 0 else np.inf


@kernel
def move_ages(ages, down, right, moved):
    """
    Move a number by tile, float32, by a number of pixels: linear between the tiles' centres.

    Tiles from beyond the border get 0.
    """
    rows, columns = ages.shape
    tiles_down, tiles_right = int(np.floor(down / TILE)), int(np.floor(right / TILE))
    share_down, share_right = down / TILE - tiles_down, right / TILE - tiles_right
    for row in range(rows):
        for column in range(columns):
            age = 0.0
            for above in range(2):
                for left in range(2):
                    source_row, source = row - tiles_down - above, column - tiles_right - left
                    if 0 <= source_row < rows and 0 <= source < columns:
                        share = ((share_down if above else 1 - share_down)
                                 * (share_right if left else 1 - share_right))
                        age += share * ages[source_row, source]
            moved[row, column] = age


@kernel
def move_map(source, choices, down, right, outside, result, first, last):
    """
    Move a map (R, C) down and right, except in tiles that stayed in place.

    outside: value of pixels from beyond the border; first, last: tile rows
    """
    rows, columns = source.shape
    begin = min(max(right, 0), columns)
    end = max(min(columns + right, columns), begin)
    for row in range(first * TILE, min(last * TILE, rows)):
        line, origin = result[row], row - down
        if 0 <= origin < rows and begin < end:
            line[:begin] = outside
            copy_row(source[origin, begin - right:end - right], line[begin:end])
            line[end:] = outside
        else:
            line[:] = outside
        tile, chosen = 0, choices[row // TILE]
        while tile < len(chosen):
            run, choice = tile, chosen[tile]
            while tile < len(chosen) and chosen[tile] == choice:
                tile += 1
            if choice == 0:
                copy_row(source[row, run * TILE:tile * TILE], line[run * TILE:tile * TILE])


@kernel
def tile_strengths(found, ages, searched, most, choices, strengths):
    """
    Write the weight of the previous best in each tile: uint8, 0 in and beside changed tiles.

    found: choices of averaging; choices: the same, -1 where a tile has changed since the last
    search, `searched` frames ago; most: the largest strength, reached after as many previous
    frames
    """
    rows, columns = choices.shape
    for row in range(rows):
        for column in range(columns):
            choices[row, column] = found[row, column] if ages[row, column] > searched else -1
    for row in range(rows):
        above, below = max(row - 1, 0), min(row + 1, rows - 1)
        for column in range(columns):
            left, right = max(column - 1, 0), min(column + 1, columns - 1)
            least = min(choices[row, left], choices[row, column], choices[row, right],
                        choices[above, column], choices[below, column])
            strength = min(max(int(ages[row, column] + 0.5) - 1, 1), most)
            strengths[row, column] = strength if least >= 0 else 0


@kernel
def trusted_cells(labels, validity, half, distance, half_labels, trusted, first, last):
    """
    Mark the half-size pixels where the previous best is trusted.

    labels, validity: of the previous best; half: (r, c), labels of this frame's half map;
    half_labels: (r, c), written, the previous best on the half grid; trusted: uint8 (r, c), 1
    where it was consistent and is within `distance` of the half map; first, last: half rows
    """
    for row in range(first, last):
        line, was, seen = labels[2 * row], validity[2 * row], half[row]
        found, marks = half_labels[row], trusted[row]
        for column in range(half.shape[1]):
            label = line[2 * column]
            found[column] = label
            apart = abs(2 * np.int32(seen[column]) - np.int32(label))
            marks[column] = (apart <= distance) & (was[2 * column] == CONSISTENT)


@kernel(allocates=True)
def previous_prior(trusted, smooth, strengths, weights, first, last):
    """
    Write the weights of the prior, uint8 (R, C).

    trusted, smooth: uint8 (r, c); strengths: uint8, by tile, the weight where both are 1; first,
    last: tile rows
    """
    rows, columns = trusted.shape
    half_tile = TILE // 2
    strength = np.zeros(columns + half_tile, np.uint8)
    for row in range(first * TILE, min(last * TILE, weights.shape[0])):
        if row % TILE == 0:
            for column in range(columns):
                strength[column] = strengths[row // TILE, column // half_tile]
        source = min(row // 2, rows - 1)
        one, other, line = trusted[source], smooth[source], weights[row]
        for column in range(columns):
            weight = one[column] * other[column] * strength[column]
            line[2 * column] = weight
            line[2 * column + 1] = weight
        if weights.shape[1] > 2 * columns:
            line[2 * columns] = line[2 * columns - 1]
