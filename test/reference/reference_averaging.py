# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Plain twins of what averages pictures over frames, and of where the previous best counts."""
import numpy as np
from reference_warp import origins_of_tiles


def moved(values, down, right, outside):
    """Return an array (R, C) moved down and to the right; what comes from beyond is `outside`."""
    origins = origins_of_tiles(np.ones(values.shape), down, right, values.shape)
    return np.where(origins < 0, outside, values.flat[origins])


def tiles_of(shape, tile):
    """Return a slice for each tile, as a dictionary by row and column of tiles."""
    counts = -(-shape[0] // tile), -(-shape[1] // tile)
    return {(row, column): np.s_[row * tile:(row + 1) * tile, column * tile:(column + 1) * tile]
            for row, column in np.ndindex(*counts)}


def tile_differences(now, before, down, right, tile=16, block=4):
    """Return the differences of each tile as the kernel does: float64 (8, rows, columns)."""
    there = moved(before.astype(np.int64), down, right, -1)
    inside = there >= 0
    difference = np.where(inside, (now.astype(np.int64) >> 3) - (there >> 3), 0) / 32
    tiles = tiles_of(now.shape, tile)
    found = np.zeros((8, *np.add(max(tiles), 1)))
    slopes, changes = _of_strips(difference, np.where(inside, there >> 3, 0), inside, block)
    for at, place in tiles.items():
        strips = np.s_[at[0] * tile // block:(at[0] + 1) * tile // block, place[1]]
        found[(slice(4, 7), *at)] = _motion(
            slopes[strips], changes[strips], max(inside[place].sum() // block, 1))
        number = inside[place].sum()
        if number == 0:
            found[0][at] = np.inf
            continue
        found[(7, *at)] = (there[place][inside[place]] >> 3).sum() / 32 / number
        parts = [difference[place][part] for part in tiles_of(inside[place].shape, block).values()]
        sums = np.array([abs(part.sum()) for part in parts])
        sizes = np.array([abs(part).sum() for part in parts])
        found[(slice(0, 4), *at)] = (sizes.sum() / number, block * sums.sum() / number,
                                     sums.max() / block**2, sizes.max() / block**2)
    return found


def _of_strips(difference, there, inside, block, steepest=1024):
    """Return slopes and differences of sums of rows, cut: (strips, C)."""
    starts = range(0, len(there), block)
    lines = np.add.reduceat(there, starts, axis=0)
    columns = np.flatnonzero(inside.any(axis=0))
    slopes = np.zeros_like(lines)
    if columns.size:
        seen = np.pad(lines[:, columns], ((0, 0), (1, 1)), 'edge')
        slopes[:, columns] = seen[:, 2:] - seen[:, :-2]
    sums = np.add.reduceat(np.rint(32 * difference).astype(np.int64), starts, axis=0)
    return np.clip(slopes, -steepest, steepest), np.clip(sums, -steepest, steepest)


def _motion(slopes, changes, number):
    """Return the sum of products without the means, its variance, and the sum of squares."""
    products, squares = slopes * changes >> 8, (slopes**2).sum()
    varies = 1 - slopes.sum()**2 / number / max(squares, 1)
    varies = varies if varies > 0.02 else 0
    total = products.sum() - slopes.sum() * changes.sum() / number / 256
    return total if varies else 0, (products**2).sum() * varies, squares


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


def tile_noises(differences, rough, expected=0.2, factor=0.61):
    """Return the noise of each tile, and that of the picture; see the kernel."""
    def quiet(values):
        return np.partition(values, int(expected * (values.size - 1)))[
            int(expected * (values.size - 1))]

    def noise(half):
        return min(quiet(smallest[half]), factor * quiet(rough[half]))
    smallest, brightness = differences[:, 0].min(axis=0), differences[0, 7].astype(float)
    bright = brightness > brightness.mean()
    everywhere = noise(np.full(bright.shape, True))
    if not bright.any():
        return np.full(bright.shape, everywhere), everywhere
    (dark, darker), (loud, brighter) = (
        (noise(half)**2, brightness[half][smallest[half] <= quiet(smallest[half])].mean())
        for half in (~bright, bright))
    slope = min(max(loud - dark, 0) / max(brighter - darker, 1), dark / max(darker, 1))
    return np.sqrt(np.maximum(everywhere**2, dark + slope * (brightness - darker))), everywhere


def chosen_tiles(differences, ages, noises, rules, rests=0.9):
    """Return the shift of each tile, -1 for none, and how old it is then."""
    choices, new_ages = _chosen(differences, ages, np.stack([noises] * len(ages)), rules)
    if np.mean(choices >= 0) > rests:
        both = np.sqrt(1 + 1 / np.maximum(ages, 1))
        return _chosen(differences, ages, noises * np.maximum(both / np.median(both), 1), rules)
    return choices, new_ages


def _chosen(differences, ages, noises, rules):
    choices, new_ages = np.full(ages.shape[1:], -1), np.ones(ages.shape[1:])
    for at in np.ndindex(choices.shape):
        shift = int(np.argmin(differences[(slice(None), 0, *at)]))
        size, *blocks = differences[(shift, slice(4), *at)]
        mosts = (rules.WHITE, rules.PEAK_LIMIT, rules.BUMP_LIMIT)
        if (ages[(shift, *at)] > 0 and size <= rules.LOUD * noises[(shift, *at)] + rules.SLACK
                and all(block <= most * size + 2 * rules.SLACK
                        for block, most in zip(blocks, mosts))):
            choices[at], new_ages[at] = shift, min(ages[(shift, *at)] + 1, rules.OLDEST)
    return choices, new_ages


def strengths(choices, ages, most):
    """Return how much the previous best counts by tile: by age, 0 in and beside what changed."""
    around = np.pad(choices, 1, 'edge')
    least = np.min([choices, around[1:-1, :-2], around[1:-1, 2:], around[:-2, 1:-1],
                    around[2:, 1:-1]], axis=0)
    return np.where(least >= 0, np.clip(np.floor(ages + 0.5) - 1, 1, most), 0)


def added_drifts(differences, rules, choices, drifts_then):
    """Return the drifts of tiles with this frame: float64 (2, tile rows, tile columns)."""
    found, keep = np.zeros((2, *choices.shape)), 1 - 1 / rules.OLDEST
    for at in np.ndindex(choices.shape):
        if choices[at] >= 0:
            size, blocks, _, _, product, variance, _ = differences[(choices[at], slice(None), *at)]
            total, before = drifts_then[(choices[at], slice(None), *at)]
            found[(slice(None), *at)] = (
                keep * total + product,
                keep**2 * before + variance * max(blocks / max(size, 1e-6), 1)**2)
    return found


def drifting(rules, choices, drifts):
    """Return which tiles drift, alone or with those around them: bool."""
    found = np.zeros(choices.shape, bool)
    for row, column in np.argwhere(choices >= 0):
        around = drifts[:, max(row - 1, 0):row + 2, max(column - 1, 0):column + 2]
        found[row, column] = any(total**2 > rules.DRIFT**2 * variance for total, variance in (
            around.sum(axis=(1, 2)), drifts[:, row, column]))
    return found


def matched(labels, offset, shift, row, column):
    """Return the mirrored column that a pixel matches, and where both were; None if outside."""
    down, across = shift
    (rows, columns), before = labels.shape, (row - down, column - across)
    if not (0 <= before[0] < rows and 0 <= before[1] < columns):
        return None
    there = columns - 1 - (column - int(labels[before]) - offset)
    return there, before, (before[0], there + across)


def alike(views, before, labels, offset, shifts, tested, choices, tile=16, block=4):
    """Return the correlation of the changes of both views by tile: float64, 0 if not tested."""
    found = np.zeros(choices.shape)
    for at, place in tiles_of(labels.shape, tile).items():
        changes = []
        for row, column in np.argwhere(np.ones(labels[place].shape, bool)):
            pixel = row + at[0] * tile, column + at[1] * tile
            match = matched(labels, offset, shifts[choices[at]], *pixel)
            if row % block or choices[at] < 0 or not tested[at] or match is None:
                continue
            there, *source = match
            if 0 <= there < labels.shape[1] and 0 <= source[1][1] < labels.shape[1]:
                changes.append([(int(view[where]) - int(picture[was])) >> 5
                                for view, where, picture, was in zip(
                                    views, (pixel, (pixel[0], there)), before, source)])
        if len(changes) < 48:
            continue
        one, other = np.reshape(changes, (-1, 2)).T
        found[at] = (one * other).sum() / max((one**2).sum() * (other**2).sum(), 1)**0.5
    return found


def tiles_matched(labels, offset, shifts, choices, tile=16, block=4):
    """Yield the tile of each pixel of the left view that is read, and that of its match."""
    for row, column in np.ndindex(labels.shape):
        at = row // tile, column // tile
        shift = shifts[max(choices[at], 0)]
        place = row - max(at[0] * tile, shift[0]), column - max(at[1] * tile, shift[1])
        match = matched(labels, offset, shift, row, column)
        if match and not any(side % block for side in place) and 0 <= match[0] < labels.shape[1]:
            yield at, (at[0], match[0] // tile)


def ages_of_both(ages, labels, offset, shifts, choices):
    """Return the age of each tile of the left view, at most the mean of those it matches."""
    matches = [[[] for _ in line] for line in choices]
    for (row, column), there in tiles_matched(labels, offset, shifts, choices):
        matches[row][column].append(1 / ages[1][there])
    return np.array([[min(age, 1 / np.mean(found)) if found else age for age, found in zip(*line)]
                     for line in zip(ages[0], matches)])


def rejected_alike(changes, limit, labels, offset, shifts, choices):
    """Return the tiles of the left view that change alike, and those they match: bool (2, ...)."""
    rejected = np.stack([(changes > limit) & (choices >= 0), np.zeros(choices.shape, bool)])
    for here, there in tiles_matched(labels, offset, shifts, choices):
        rejected[1][there] |= rejected[0][here]
    return rejected
