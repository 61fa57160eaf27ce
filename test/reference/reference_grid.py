# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Plain twins of what plane genes on a grid of every other pixel go through."""
from fuzzy_stereo_ros.matching.kernels.units import CONSISTENT, INVALID, STEPS
import numpy as np

TILE = 16


def disparity(plane, row, column):
    """Return the disparity of a plane at a cell, in single precision."""
    a, b, c = np.float32(plane)
    return a * np.float32(column) + b * np.float32(row) + c


def moved(planes, evolved, proposals, choices, quiet, shift):
    """Return planes, evolved and proposals, moved by some cells, except in tiles that stayed."""
    found = np.zeros_like(planes), np.zeros_like(evolved), np.zeros_like(proposals)
    for row, column in np.ndindex(evolved.shape):
        tile = 2 * row // TILE, 2 * column // TILE
        down, right = shift if choices[tile] else (0, 0)
        y, x = row - down, column - right
        if quiet[tile] and 0 <= y < evolved.shape[0] and 0 <= x < evolved.shape[1]:
            a, b, c = planes[y, x]
            found[0][row, column] = a, b, c - a * np.float32(right) - b * np.float32(down)
            found[1][row, column], found[2][row, column] = evolved[y, x], proposals[y, x]
    return found


def sampled(chromosome, labels, offsets, validity, margins, clear):
    """Return disparities, what is consistent, what is mutated, and doubts: (r, c), of cells."""
    same, consistent = chromosome == labels, validity != INVALID
    disparities = chromosome + np.where(same, offsets / np.float32(STEPS), np.float32(0))
    doubts = clear - np.where(validity == CONSISTENT, np.minimum(margins, clear), 0)
    away = abs(chromosome.astype(int) - labels) > 1
    return disparities.astype(np.float32), consistent, consistent & away, doubts


def tangents(disparities, reach, limit):
    """Return the planes through disparities, sloped as those `reach` cells around: (r, c, 3)."""
    found = np.zeros((*disparities.shape, 3), np.float32)
    for place in np.ndindex(disparities.shape):
        here = disparities[place]
        for part, axis in ((0, 1), (1, 0)):
            ends = [list(place), list(place)]
            ends[0][axis] -= reach
            ends[1][axis] += reach
            if ends[0][axis] >= 0 and ends[1][axis] < disparities.shape[axis]:
                before, after = (disparities[tuple(end)] for end in ends)
                if abs(before - here) < limit and abs(after - here) < limit:
                    found[place][part] = (after - before) / (2 * reach)
        found[place][2] = here - found[place][0] * place[1] - found[place][1] * place[0]
    return found


def costs(volume, planes, origin, inside, largest, unit):
    """Return what the matches of planes cost: int (r, c); volume: (R, C, labels)."""
    found = np.zeros(planes.shape[:2], np.int64)
    top = volume.shape[2] - 1
    for row, column in np.ndindex(found.shape):
        y, x = 2 * row + origin[0], 2 * column + origin[1]
        d = disparity(planes[row, column], row, column)
        if not -0.5 <= d <= top + 0.5:
            found[row, column] = unit
            continue
        d = min(max(d, np.float32(0)), np.float32(top))
        low = int(d)
        high = min(low + 1, top)
        if x - high < inside[0] or x - low > inside[1]:
            found[row, column] = unit // 2
        else:
            ends = np.float32(volume[y, x, [low, high]])
            cost = ends[0] + (d - np.float32(low)) * (ends[1] - ends[0])
            found[row, column] = int(cost * (np.float32(unit) / np.float32(largest))
                                     + np.float32(0.5))
    return found


def visible(disparities, right, begin, places):
    """Return which cells nothing nearer of their row hides: bool (r, c)."""
    found = np.zeros(disparities.shape, bool)
    for row, line in enumerate(disparities):
        columns = np.float32(2 * np.arange(line.size) + right)
        pointed = (np.rint(columns - line).astype(int) - begin) >> 1
        for column, place in enumerate(pointed):
            same = line[pointed == place]
            found[row, column] = 0 <= place < places and same.max() <= line[column] + 1
    return found


def like(fine, pixel, origin, shape):
    """Return the cell around a pixel, from the one at its upper left on, most like it in grey."""
    y, x = pixel
    row, column = (y - origin[0]) // 2, (x - origin[1]) // 2
    cells = [(r, c) for r in range(row, row + 1 + (y - origin[0]) % 2)
             for c in range(column, column + 1 + (x - origin[1]) % 2)
             if r < shape[0] and c < shape[1]]
    return min(cells, key=lambda cell: abs(
        int(fine[2 * cell[0] + origin[0], 2 * cell[1] + origin[1]]) - int(fine[y, x])))


def written(planes, evolved, fine, origin, apart, highest, chromosome):
    """Return labels in which pixels around evolved cells have those of their planes."""
    found = chromosome.copy()
    for y in range(origin[0], min(2 * evolved.shape[0] + origin[0], chromosome.shape[0])):
        for x in range(origin[1], min(2 * evolved.shape[1] + origin[1], chromosome.shape[1])):
            cell = like(fine, (y, x), origin, evolved.shape)
            half = np.float32(0.5)
            a, b, c = planes[cell]
            d = a * (half * np.float32(x - origin[1])) + b * (half * np.float32(y - origin[0])) + c
            d = min(max(d, np.float32(0)), np.float32(highest))
            if evolved[cell] and abs(d - np.float32(chromosome[y, x])) >= apart:
                found[y, x] = np.rint(d)
    return found
