# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Plain twins of regions of weak texture, their planes and the mutant: realtime/operators.py."""
import numpy as np


def runs(line, weak, step):
    """Return (begin, end) of the runs of like pixels of a row of weak texture."""
    found, mean = [], 0
    for column, grey in enumerate(int(value) for value in line):
        if not weak[column]:
            continue
        if found and found[-1][1] == column and abs(grey - mean) <= step:
            found[-1][1] = column + 1
            mean += (grey - mean) // 4
        else:
            found.append([column, column + 1])
            mean = grey
    return found


def regions(grey, weak, step, apart, overlap, least):
    """Return the number of each pixel's region, -1 for none: int (r, c)."""
    # Regions are numbered by their first pixels.
    rows = [runs(line, flags, step) for line, flags in zip(grey, weak)]
    nodes = [(row, begin, end) for row, found in enumerate(rows) for begin, end in found]
    joined = np.eye(len(nodes), dtype=bool)
    for one, (row, begin, end) in enumerate(nodes):
        for other, (above, first, last) in enumerate(nodes):
            low, high = max(begin, first), min(end, last)
            if above == row - 1 and high - low >= overlap:
                difference = abs(int(grey[row, low:high].sum(dtype=np.int64))
                                 - int(grey[above, low:high].sum(dtype=np.int64)))
                joined[one, other] = joined[other, one] = difference <= apart * (high - low)
    for _ in range(len(nodes).bit_length()):        # each doubles the longest way
        joined = (joined.astype(np.float32) @ joined.astype(np.float32)) > 0
    numbers, sizes = np.full(grey.shape, -1), {}
    for one, (row, begin, end) in enumerate(nodes):
        first = int(np.argmax(joined[one]))
        numbers[row, begin:end] = first
        sizes[first] = sizes.get(first, 0) + end - begin
    kept = [first for first in sorted(sizes) if sizes[first] >= least]
    return np.array([kept.index(number) if number in kept else -1
                     for number in numbers.flat]).reshape(grey.shape)


def points(numbers, region, most, disparities, trusted):
    """Return x, y and disparity of trusted pixels of a region, (3, n), evenly spread."""
    # disparities, trusted: (R, C), of the full image
    sampled = trusted[1::2, 1::2][:numbers.shape[0], :numbers.shape[1]]
    rows, columns = np.nonzero((numbers == region) & sampled)
    every = max(-(-rows.size // most), 1)
    rows, columns = rows[every - 1::every], columns[every - 1::every]
    return np.array([columns, rows, disparities[2 * rows + 1, 2 * columns + 1]])


def mutant(numbers, planes, disparities, inside, parent):
    """Return the parent with the labels of planes where they are farther than one."""
    child = parent.copy()
    for y, x in np.argwhere(numbers.repeat(2, 0).repeat(2, 1) >= 0):
        a, b, c = planes[numbers[y // 2, x // 2]]
        label = np.floor(a * (x - 1) / 2 + b * (y - 1) / 2 + c + 0.5)
        if (0 <= label < disparities and inside[0] <= x - label <= inside[1]
                and abs(label - int(parent[y, x])) > 1):
            child[y, x] = label
    return child
