# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Scanline optima from eight directions, along the surface of a parent (Hirschmueller, 2008).

Not in the paper: the best map that the data alone give. With a parent, smooth means an equal
distance to the parent's surface instead of an equal label (Scharstein, Taniai and Sinha,
Semi-global stereo matching with surface orientation priors, 2017): slanted surfaces cost nothing.
Four directions are summed on the way down the rows, the others on the way up, where the labels
are chosen at once. Sums are uint16: a path costs at most FULL + P2.
"""
from typing import NamedTuple

from fuzzy_stereo_ros.matching.kernels.compiled import called, inlined, kernel
from fuzzy_stereo_ros.matching.kernels.simd import (
    add, at_most, choose, equal_bits, first_set, lane_numbers, LANES, load, lowest, minimum, splat,
    store, subtract)
import numpy as np

BESIDE = 8           # elements on both sides of a pixel's labels; a parent's step is less
FAR = 30000          # costs more than any path
STRETCH = 0.8        # power of twice an offset; below 1 it grows
ALONG, DOWN_RIGHT, DOWN, DOWN_LEFT = range(4)      # planes of grey steps
_RIGHTWARDS = 1, 1, 0, -1     # columns that a path steps on the way down, by plane


class ParentSurface(NamedTuple):
    """The surface of a parent, which paths follow."""

    labels: np.ndarray   # int16 (R, C)
    steepest: int        # its largest step that is followed


class StepPenalties(NamedTuple):
    """What a change of labels costs, by the step of grey between two pixels."""

    steps: np.ndarray    # uint8 (4, R, C), of grey to the left, above left, above, above right
    small: np.ndarray    # uint16 (256,), P1
    jump: np.ndarray     # uint16 (256,), P2


class Paths(NamedTuple):
    """Memory of the four paths to the pixels of an even and of an odd row."""

    costs: np.ndarray    # uint16 (2, 4, C, labels + 2 * BESIDE)
    least: np.ndarray    # uint16 (2, 4, C), of each path's costs


@called
def _begin(costs, cell, labels, paths, place):
    """Write the costs of a path that begins at a pixel, those of its match; return the least."""
    least = splat(np.uint16(FAR))
    for block in range(0, labels, LANES):
        cost = load(costs, cell + block)
        store(paths, place + block, cost)
        least = minimum(least, cost)
    return lowest(least)


@called
def _step(costs, cell, labels, path, least, penalty, paths, place):
    """
    Write the costs of a path that goes on by a pixel; return the least.

    path: index in `paths` of the path so far to the label that continues as label 0; its
    neighbours in memory are those of the labels below and above; penalty: P1 and P2.
    """
    small, jump = penalty
    limit, step, base = splat(np.uint16(least + jump)), splat(small), splat(least)
    smallest = splat(np.uint16(FAR))
    for block in range(0, labels, LANES):
        near = add(minimum(load(paths, path + block - 1), load(paths, path + block + 1)), step)
        best = minimum(minimum(load(paths, path + block), limit), near)
        cost = add(load(costs, cell + block), subtract(best, base))
        store(paths, place + block, cost)
        smallest = minimum(smallest, cost)
    return lowest(smallest)


@called
def _row_of_paths(costs, parent, penalties, row, other, begins, upwards, paths):
    """Continue all four paths by a row; other: the row before, in the direction of the pass."""
    steps, small, jump = penalties
    columns, labels = costs.shape[1:]
    flat, flat_paths, stride = costs.reshape(-1), paths.costs.reshape(-1), labels + 2 * BESIDE
    least = paths.least
    here, there = row & 1, other & 1
    for number in range(columns):
        column = columns - 1 - number if upwards else number
        cell, surface = (row * columns + column) * labels, np.int64(parent.labels[row, column])
        for plane in range(4):
            near = column + _RIGHTWARDS[plane] if upwards else column - _RIGHTWARDS[plane]
            place = ((here * 4 + plane) * columns + column) * stride + BESIDE
            sideways = plane == ALONG
            if near < 0 or near >= columns or begins and not sideways:
                least[here, plane, column] = _begin(flat, cell, labels, flat_paths, place)
                continue
            source, parity = (row, here) if sideways else (other, there)
            step = steps[plane, source, near] if upwards else steps[plane, row, column]
            shift = surface - np.int64(parent.labels[source, near])
            if abs(shift) > parent.steepest:
                shift = 0
            path = ((parity * 4 + plane) * columns + near) * stride + BESIDE - shift
            least[here, plane, column] = _step(
                flat, cell, labels, path, least[parity, plane, near], (small[step], jump[step]),
                flat_paths, place)


@called
def _add_paths(paths, parity, columns, labels, sums, place):
    """Add the four paths of a row to sums from an index on."""
    flat, stride = paths.reshape(-1), labels + 2 * BESIDE
    plane = columns * stride
    for column in range(columns):
        path = (parity * 4 * columns + column) * stride + BESIDE
        for block in range(0, labels, LANES):
            total = add(add(load(flat, path + block), load(flat, path + plane + block)),
                        add(load(flat, path + 2 * plane + block),
                            load(flat, path + 3 * plane + block)))
            store(sums, place + block, add(load(sums, place + block), total))
        place += labels


@kernel(allocates=True)
def sum_paths(costs, parent, penalties, sums, upwards, begin, first):
    """
    Write the sums of the paths from the left and from above, or add those of the way upwards.

    parent, penalties: of a ParentSurface, of StepPenalties; sums: uint16 (n, C, labels), of n rows
    from `first` on; upwards: add the paths from the right and from below; begin: the row in which
    the paths start
    """
    parent, penalties = ParentSurface(*parent), StepPenalties(*penalties)
    columns, labels = costs.shape[1:]
    paths = Paths(np.full((2, 4, columns, labels + 2 * BESIDE), np.uint16(FAR)),
                  np.empty((2, 4, columns), np.uint16))
    flat, last = sums.reshape(-1), first + len(sums)
    stop, onwards = (first - 1, -1) if upwards else (last, 1)
    for row in range(begin, stop, onwards):
        _row_of_paths(costs, parent, penalties, row, row - onwards, row == begin, upwards, paths)
        if first <= row < last:
            if not upwards:
                sums[row - first] = 0
            _add_paths(paths.costs, row & 1, columns, labels, flat,
                       (row - first) * columns * labels)


@called
def _stretched(offset):
    """Return an offset moved away from whole pixels, to which costs of supports bias it."""
    size = np.float32(0.5) * np.float32(2 * abs(offset))**np.float32(STRETCH)
    return size if offset > 0 else -size


@inlined
def _least_sum(sums, at, blocks):
    """Return the least sum of `blocks` blocks of labels from `at` on."""
    smallest = load(sums, at)
    for block in range(1, blocks):
        smallest = minimum(smallest, load(sums, at + LANES * block))
    return lowest(smallest)


@inlined
def _best_label(sums, at, blocks):
    """Return the index of the least sum from `at` on, the first of equals, and that sum."""
    least = _least_sum(sums, at, blocks)
    for block in range(blocks):
        bits = equal_bits(load(sums, at + LANES * block), splat(least))
        if bits != 0:
            return LANES * block + first_set(bits), least
    return 0, least


@kernel(allocates=True)
def choose_labels(sums, disparities, chosen, first):
    """
    Choose the labels of least sum of some rows, seen from both sides.

    sums: uint16 (n, C, padded labels), of n rows from `first` on; those from `disparities` on are
    overwritten; chosen, written, (R, C): labels, int16; offsets of the minimum of two lines,
    float32, stretched; margins, uint16, how much worse the best label elsewhere is; int16
    (R, extra + C), labels of the target's pixels, the extra ones before column 0
    """
    labels, offsets, margins, target = chosen
    columns, padded = sums.shape[1:]
    flat, best_sums = sums.reshape(-1), np.empty(columns + padded, np.uint16)
    best_labels = np.empty(columns + padded, np.uint16)
    for row in range(first, first + len(sums)):
        best_sums[:] = 65535
        best_labels[:] = 0
        for column in range(columns):
            cell = sums[row - first, column]
            cell[disparities:] = 65535
            place = ((row - first) * columns + column) * padded
            best, least = _best_label(flat, place, padded // LANES)
            begin = columns - 1 - column
            for block in range(0, padded, LANES):
                total, known = load(flat, place + block), load(best_sums, begin + block)
                store(best_labels, begin + block, choose(
                    at_most(total, known), add(lane_numbers(total), splat(np.uint16(block))),
                    load(best_labels, begin + block)))
                store(best_sums, begin + block, minimum(total, known))
            low, high = max(best - 1, 0), min(best + 1, disparities - 1)
            before, after = cell[low], cell[high]
            cell[low], cell[best], cell[high] = 65535, 65535, 65535
            margins[row, column] = _least_sum(flat, place, padded // LANES) - least
            cell[low], cell[high] = before, after
            cell[best] = least
            labels[row, column] = best
            rise = np.int64(max(before, after)) - np.int64(least)
            inside = 0 < best < disparities - 1 and rise > 0
            offsets[row, column] = _stretched(
                np.float32(np.int64(before) - np.int64(after)) / np.float32(2 * rise)) \
                if inside else 0
        last = target.shape[1] - 1
        for column in range(last + 1):
            target[row, column] = best_labels[last - column]
