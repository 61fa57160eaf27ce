# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Plain twins of what averages pictures over frames, and of where the previous best counts."""
import numpy as np


def moved(values, down, right, outside):
    """Return an array (R, C) moved down and to the right; what comes from beyond is `outside`."""
    found = np.full_like(values, outside)
    for row, column in np.ndindex(values.shape):
        if 0 <= row - down < values.shape[0] and 0 <= column - right < values.shape[1]:
            found[row, column] = values[row - down, column - right]
    return found


def tiles_of(shape, tile):
    """Return a slice for each tile, as a dictionary by row and column of tiles."""
    counts = -(-shape[0] // tile), -(-shape[1] // tile)
    return {(row, column): np.s_[row * tile:(row + 1) * tile, column * tile:(column + 1) * tile]
            for row, column in np.ndindex(*counts)}


def tile_differences(now, before, down, right, tile=16, block=4):
    """Return the four differences of each tile, in grey levels: float64 (4, rows, columns)."""
    there = moved(before.astype(np.int64), down, right, -1)
    inside = there >= 0
    difference = np.where(inside, (now.astype(np.int64) >> 3) - (there >> 3), 0) / 32
    tiles = tiles_of(now.shape, tile)
    found = np.zeros((4, *np.add(max(tiles), 1)))
    for at, place in tiles.items():
        number = inside[place].sum()
        if number == 0:
            found[0][at] = np.inf
            continue
        parts = [difference[place][part] for part in tiles_of(inside[place].shape, block).values()]
        sums = np.array([abs(part.sum()) for part in parts])
        sizes = np.array([abs(part).sum() for part in parts])
        found[(slice(None), *at)] = (sizes.sum() / number, block * sums.sum() / number,
                                     sums.max() / block**2, sizes.max() / block**2)
    return found


def roughness(luminance, tile=16, every=4):
    """Return the mean second difference along each fourth row by tile: float64."""
    around = np.pad(luminance.astype(np.int64), ((0, 0), (1, 1)), 'edge')
    bent = abs(2 * around[:, 1:-1] - around[:, :-2] - around[:, 2:]) / 256
    tiles = tiles_of(luminance.shape, tile)
    found = np.zeros(np.add(max(tiles), 1))
    for at, place in tiles.items():
        found[at] = bent[place][::every].mean()
    return found


def moved_ages(ages, down, right, tile=16):
    """Return numbers by tile, moved: linear between the tiles' centres, 0 beyond the border."""
    found = ages.astype(np.float64)
    for axis, shift in enumerate((down, right)):
        size = ages.shape[axis]
        grid, places = np.arange(-1, size + 1), np.arange(size) - shift / tile
        found = np.apply_along_axis(
            lambda line, grid=grid, places=places: np.interp(places, grid, [0, *line, 0]),
            axis, found)
    return found


def blended(luminance, before, shifts, choices, ages, limits, tile=16):
    """Return luminance grey moved towards the picture before, as the tiles say: int64 (R, C)."""
    found = luminance.astype(np.int64)
    for at, place in tiles_of(luminance.shape, tile).items():
        if choices[at] < 0:
            continue
        there = moved(before.astype(np.int64), *shifts[choices[at]], -1)[place]
        limit, weight = int(256 * min(limits[at], 255)), int(65536 - 65536 / ages[at])
        difference = np.clip(found[place] - there, -limit, limit)
        step = np.sign(difference) * (abs(difference) * weight // 65536)
        found[place] -= np.where(there >= 0, step, 0)
    return found


def chosen_tiles(differences, ages, noise, rules):
    """Return the shift of each tile, -1 for none, and how old it is then."""
    choices, new_ages = np.full(ages.shape[1:], -1), np.ones(ages.shape[1:])
    for at in np.ndindex(choices.shape):
        shift = int(np.argmin(differences[(slice(None), 0, *at)]))
        size, *blocks = differences[(shift, slice(None), *at)]
        mosts = (rules.white, rules.peak, rules.bump)
        if (ages[(shift, *at)] > 0 and size <= rules.loud * noise + rules.slack
                and all(block <= most * size + 2 * rules.slack
                        for block, most in zip(blocks, mosts))):
            choices[at], new_ages[at] = shift, min(ages[(shift, *at)] + 1, rules.oldest)
    return choices, new_ages


def strengths(choices, ages, most):
    """Return how much the previous best counts by tile: by age, 0 in and beside what changed."""
    around = np.pad(choices, 1, 'edge')
    least = np.min([choices, around[1:-1, :-2], around[1:-1, 2:], around[:-2, 1:-1],
                    around[2:, 1:-1]], axis=0)
    return np.where(least >= 0, np.clip(np.floor(ages + 0.5) - 1, 1, most), 0)


def brought_forward(source, choices, down, right, outside, tile=16):
    """Return a map moved, but for the tiles whose choice is 0."""
    found = moved(source, down, right, outside)
    for at, place in tiles_of(source.shape, tile).items():
        if choices[at] == 0:
            found[place] = source[place]
    return found
