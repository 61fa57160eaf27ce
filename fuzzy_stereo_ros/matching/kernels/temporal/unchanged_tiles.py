# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Find the tiles that differ from the previous picture by noise alone.

Noise is independent in both views of a pair, while moving texture changes both in the same way, as
matched by the disparities of the previous frame. An object that comes nearer may stay in place in
one of the views.
"""
from fuzzy_stereo_ros.matching.kernels.addresses import of_rank
from fuzzy_stereo_ros.matching.kernels.compiled import called, inlined, kernel
from fuzzy_stereo_ros.matching.kernels.possibility.features import MARGIN
from fuzzy_stereo_ros.matching.kernels.temporal.change_detection import (
    BLOCK, BLOCKS, BRIGHTNESS, BUMP, MOTION, SIZE, SIZE_OF_NOISE, STEEPNESS, TILE, UNITS, VARIANCE)
import numpy as np

QUIET_TILES = 0.2    # share of the tiles that are expected to differ by noise alone
ROUGH = 0.61         # most noise by its second differences: 1.5 / sqrt(6) of their mean size
REJOINED = 0.9       # share of unchanged tiles from which changed ones may be averaged again
# Limits of the differences of an unchanged tile: of pixels, as a factor of those of noise; of the
# means of blocks (1 in white noise), the mean and the pixels of any block, as factors of those of
# the tile's pixels; grey levels added to each limit, twice to those of blocks.
LOUD, WHITE, PEAK_LIMIT, BUMP_LIMIT, SLACK = 1.2, 1.5, 1.3, 1.8, 0.3
OLDEST = 32          # largest number of frames that are averaged
DRIFT = 6.0          # limit of a drift, in standard deviations of the sum of noise over frames
FAINTER, STRONGER = 0.4, 1.5    # contrast of texture that moved, as a factor of its differences
SLOPE_CUT = 8.0     # grey levels that contrast reaches at least in strong texture: slopes are cut
LEAST_COMPARED = 3 * TILE**2 // (4 * BLOCK)     # pixels; noise of fewer may correlate by chance
LOW_BITS = 5        # of luminance that are dropped, so that sums of products fit


@kernel(allocates=True)
def tile_noises(differences, rough, noises):
    """
    Measure the noise of each tile; return that of the picture: grey levels, standard deviation.

    noises: written, at least the noise of the picture, more in bright tiles. The variance of noise
    is a line over grey levels, fitted to the darker and the brighter tiles; it is steepest for
    photon noise, whose line goes through the origin.
    """
    smallest = differences[0, SIZE].ravel().copy()
    brightness = differences[0, BRIGHTNESS].ravel()
    for shift in range(1, len(differences)):
        further = differences[shift, SIZE].ravel()
        for tile in range(smallest.size):
            smallest[tile] = min(smallest[tile], further[tile])
    rough, flat, mean = rough.ravel(), noises.ravel(), 0.0
    for grey in brightness:
        mean += grey
    mean /= brightness.size
    _, noise = _noise(smallest, rough, brightness, -np.inf, np.inf)
    flat[:] = noise
    brighter, loud = _noise(smallest, rough, brightness, mean, np.inf)
    if brighter <= mean:        # all are alike
        return noise
    darker, dark = _noise(smallest, rough, brightness, -np.inf, mean)
    dark, loud = dark**2, loud**2
    slope = min(max(loud - dark, 0.0) / max(brighter - darker, 1.0), dark / max(darker, 1.0))
    for tile in range(flat.size):
        flat[tile] = np.sqrt(
            max(noise * noise, dark + slope * (np.float64(brightness[tile]) - darker)))
    return noise


@called(allocates=True)
def _noise(differences, rough, brightness, darkest, brightest):
    """
    Return the mean grey level of the quiet ones of some tiles, and their noise; 0 for no tiles.

    The noise of tiles shows in their differences and in their second differences.

    darkest, brightest: the tiles are brighter than the one and at most as bright as the other
    """
    some, roughs, number = np.empty_like(differences), np.empty_like(rough), 0
    for tile in range(differences.size):
        if darkest < brightness[tile] <= brightest:
            some[number], roughs[number], number = differences[tile], rough[tile], number + 1
    if number == 0:
        return 0.0, 0.0
    place = int(QUIET_TILES * (number - 1))
    quiet, total, quiets = of_rank(some, number, place), 0.0, 0
    for tile in range(differences.size):
        if darkest < brightness[tile] <= brightest and differences[tile] <= quiet:
            total, quiets = total + brightness[tile], quiets + 1
    return total / quiets, min(
        np.float64(quiet), ROUGH * np.float64(of_rank(roughs, number, place)))


@kernel(allocates=True)
def choose_tiles(differences, ages, noises, choices, new_ages, sizes):
    """
    Decide which tiles are unchanged, and after which shift.

    Where nearly all are, tiles may differ more whose average of fewer frames is noisier itself.

    ages: (N, ...), by shift; new_ages: with this frame; sizes: float32, the difference
    """
    louder = np.ones(ages.shape, np.float32)
    share = _choose(differences, ages, noises, louder, choices, new_ages, sizes)
    if share > REJOINED:
        flat, old = louder.ravel(), ages.ravel()
        for tile in range(flat.size):
            flat[tile] = np.sqrt(1 + 1 / max(old[tile], np.float32(1)))
        some, number = flat.copy(), flat.size
        usual = (of_rank(some, number, (number - 1) // 2)
                 + of_rank(some, number, number // 2)) / np.float32(2)
        for tile in range(flat.size):
            flat[tile] = max(flat[tile] / usual, np.float32(1))
        _choose(differences, ages, noises, louder, choices, new_ages, sizes)


@called
def _choose(differences, ages, noises, louder, choices, new_ages, sizes):
    """Decide as choose_tiles, return the share; louder: float32, as ages, factors of noises."""
    chosen = 0
    for row in range(choices.shape[0]):
        for column in range(choices.shape[1]):
            best = 0
            for shift in range(1, len(differences)):
                if differences[shift, SIZE, row, column] < differences[best, SIZE, row, column]:
                    best = shift
            size, blocks, peak, loudest = differences[best, SIZE:BUMP + 1, row, column]
            age = ages[best, row, column]
            noise = noises[row, column] * louder[best, row, column]
            same = (age > 0 and size <= LOUD * noise + SLACK
                    and blocks <= WHITE * size + 2 * SLACK
                    and peak <= PEAK_LIMIT * size + 2 * SLACK
                    and loudest <= BUMP_LIMIT * size + 2 * SLACK)
            choices[row, column] = best if same else -1
            new_ages[row, column] = min(age + 1, OLDEST) if same else 1
            sizes[row, column] = size
            chosen += same
    return chosen / choices.size


@kernel
def add_drifts(differences, choices, drifts_then, drifts):
    """
    Add the difference of each tile in the direction of a motion to that of the previous frames.

    Noise cancels, a motion too slow to be seen in one frame adds up. drifts_then, drifts: float32
    (N, 2, ...), by shift, and (2, ...): the sum, and its variance where there is noise alone;
    older frames count less, as in the average.
    """
    keep = np.float32(1 - 1 / OLDEST)
    for row in range(choices.shape[0]):
        for column in range(choices.shape[1]):
            choice = choices[row, column]
            if choice < 0:
                drifts[:, row, column] = 0
                continue
            size, of_blocks = differences[choice, SIZE:BLOCKS + 1, row, column]
            # noise that is correlated in neighbours cancels less
            coloured = max(of_blocks / max(size, np.float32(1e-6)), np.float32(1))**2
            drifts[0, row, column] = (keep * drifts_then[choice, 0, row, column]
                                      + differences[choice, MOTION, row, column])
            drifts[1, row, column] = (keep * keep * drifts_then[choice, 1, row, column]
                                      + coloured * differences[choice, VARIANCE, row, column])


@kernel(allocates=True)
def reject_drifting(choices, ages, drifts):
    """
    Restart the average of tiles that drift, alone or with the tiles around them.

    All arguments are changed.
    """
    (rows, columns), before = choices.shape, drifts.copy()
    most = np.float32(DRIFT**2)
    for row in range(rows):
        for column in range(columns):
            if choices[row, column] < 0:
                continue
            total = variance = np.float32(0)
            for above in range(max(row - 1, 0), min(row + 2, rows)):
                for left in range(max(column - 1, 0), min(column + 2, columns)):
                    total += before[0, above, left]
                    variance += before[1, above, left]
            alone, own = before[0, row, column], before[1, row, column]
            if total * total > most * variance or alone * alone > most * own:
                choices[row, column], ages[row, column] = -1, 1
                drifts[:, row, column] = 0


@inlined
def _may_be_texture(size, steepness):
    """Return whether a tile that differs by a mean size may show texture that moved."""
    deviation = size / np.float32(SIZE_OF_NOISE)
    # of white noise, the variance of slopes of BLOCK rows is that of 2 BLOCK pixels
    contrast = np.float32(np.sqrt(steepness / np.float32(2 * TILE**2)) / np.float32(UNITS))
    return (contrast >= np.float32(FAINTER) * min(deviation, np.float32(SLOPE_CUT))
            and contrast <= np.float32(STRONGER) * deviation)


@inlined
def _match_of(labels, offset, row, column, shift):
    """Return the column of the mirrored right view that a pixel of the left one matches."""
    return labels.shape[1] - 1 - column + offset + np.int64(
        labels[row - shift[0], column - shift[1]])


@kernel
def changes_alike(views, before, labels, offset, compared, alike):
    """
    Correlate how the points of tiles changed in both views; a row in BLOCK is read.

    Only tiles in which texture may have moved are read: they differ by about their contrast.
    views: luminance of the left and the mirrored right one; before: uint16 (2, R, C), of both;
    labels: (R, C), of the left picture before; offset: of disparities from labels, px; compared:
    shifts, differences and choices of the left view; alike: float32, by tile, -1 to 1, 0 where
    less than LEAST_COMPARED pixels are compared
    """
    (left, right), (shifts, differences, choices) = views, compared
    rows, columns = labels.shape
    left_before, right_before = before[0], before[1]
    for tile_row in range(choices.shape[0]):
        for tile in range(choices.shape[1]):
            choice = choices[tile_row, tile]
            alike[tile_row, tile] = 0
            if choice < 0 or not _may_be_texture(differences[choice, SIZE, tile_row, tile],
                                                 differences[choice, STEEPNESS, tile_row, tile]):
                continue
            down, across = shifts[choice, 0], shifts[choice, 1]
            top, bottom = tile_row * TILE, min((tile_row + 1) * TILE, rows, rows + down)
            begin = max(tile * TILE, across)
            end = min((tile + 1) * TILE, columns, columns + across)
            # columns of the mirrored right picture that both frames show
            low, high = max(-across, 0), columns - max(across, 0)
            products = squares = others = number = 0
            for row in range(top, bottom, BLOCK):
                if row < down:
                    continue
                for column in range(begin, end):
                    source = column - across
                    there = _match_of(labels, offset, row, column, (down, across))
                    if low <= there < high:
                        one = (np.int64(left[row + MARGIN, column + MARGIN])
                               - np.int64(left_before[row - down, source])) >> LOW_BITS
                        other = (np.int64(right[row + MARGIN, there + MARGIN])
                                 - np.int64(right_before[row - down, there + across])
                                 ) >> LOW_BITS
                        number += 1
                        products += one * other
                        squares += one * one
                        others += other * other
            size = np.float64(squares) * np.float64(others)
            alike[tile_row, tile] = (
                products / max(size, 1.0)**0.5 if number >= LEAST_COMPARED else 0)


@kernel
def reject_alike(alike, limit, labels, offset, shifts, choices, ages):
    """
    Reject the tiles of the left view that changed alike, and those that their pixels match.

    alike, labels, offset: as in changes_alike; limit: of alike, above which a tile is rejected;
    shifts: of the left view; choices, ages: (2, ...), changed, those of the right view mirrored; a
    pixel in BLOCK x BLOCK is read.
    """
    rows, columns = labels.shape
    for tile_row in range(alike.shape[0]):
        for tile in range(alike.shape[1]):
            choice = choices[0, tile_row, tile]
            if choice < 0 or alike[tile_row, tile] <= limit:
                continue
            down, across = shifts[choice, 0], shifts[choice, 1]
            choices[0, tile_row, tile], ages[0, tile_row, tile] = -1, 1
            for row in range(max(tile_row * TILE, down),
                             min((tile_row + 1) * TILE, rows, rows + down), BLOCK):
                for column in range(max(tile * TILE, across),
                                    min((tile + 1) * TILE, columns, columns + across), BLOCK):
                    there = _match_of(labels, offset, row, column, (down, across))
                    if 0 <= there < columns:
                        choices[1, tile_row, there // TILE] = -1
                        ages[1, tile_row, there // TILE] = 1


@kernel
def ages_of_both(ages, labels, offset, shifts, choices, found):
    """
    Write for each tile of the left view its age, or that of its match in the right view if less.

    The age of the match is the harmonic mean over the matched tiles, as noise falls with 1 / age.
    ages: (2, ...), those of the right view mirrored; labels, offset: as in changes_alike; found:
    float32, by tile; a pixel in BLOCK x BLOCK is read.
    """
    rows, columns = labels.shape
    for tile_row in range(choices.shape[0]):
        for tile in range(choices.shape[1]):
            choice, number, noise = choices[tile_row, tile], 0, np.float32(0)
            down, across = (shifts[choice, 0], shifts[choice, 1]) if choice > 0 else (0, 0)
            for row in range(max(tile_row * TILE, down),
                             min((tile_row + 1) * TILE, rows, rows + down), BLOCK):
                for column in range(max(tile * TILE, across),
                                    min((tile + 1) * TILE, columns, columns + across), BLOCK):
                    mirrored = _match_of(labels, offset, row, column, (down, across))
                    if 0 <= mirrored < columns:
                        number += 1
                        noise += np.float32(1) / ages[1, tile_row, mirrored // TILE]
            age = ages[0, tile_row, tile]
            found[tile_row, tile] = age if number == 0 else min(
                age, np.float32(number) / noise)
