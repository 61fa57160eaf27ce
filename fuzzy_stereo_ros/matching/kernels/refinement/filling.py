# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Fill rejected pixels from their row and from their column.

Seen from the left image, something nearer hides a strip at its left, as wide as the disparity
jumps. A rejected run that is no such strip is a mismatch: nothing says that it is background.
"""
from fuzzy_stereo_ros.matching.kernels.compiled import kernel
from fuzzy_stereo_ros.matching.kernels.possibility.features import copy_row
from fuzzy_stereo_ros.matching.kernels.refinement.consistency import INVALID
import numpy as np

WIDEST = 3       # a run is no hidden strip when it is wider than so many jumps ...
BESIDE = 2       # ... and the columns beside it that an edge makes inconsistent


@kernel
def fill_rows(labels, validity, filled, first, last):
    """
    Copy the labels and give each rejected run the label behind it, or of the nearer of its ends.

    A row without any label takes that of the row above, or 0 in the first row of the band.
    """
    columns = labels.shape[1]
    for row in range(first, last):
        known = -1
        for column in range(columns):
            if validity[row, column] == INVALID:
                continue
            label = labels[row, column]
            if known < 0:
                filled[row, :column] = label
            elif known < column - 1:
                behind, middle = labels[row, known], (known + column) // 2 + 1
                jump = np.int64(label) - np.int64(behind)
                if jump > 0 and column - known - 1 <= WIDEST * jump + BESIDE:
                    middle = column
                filled[row, known + 1:middle] = behind
                filled[row, middle:column] = label
            filled[row, column] = label
            known = column
        if known < 0:
            for column in range(columns):
                filled[row, column] = filled[row - 1, column] if row > first else 0
        else:
            filled[row, known + 1:columns] = labels[row, known]


@kernel
def fill_columns(labels, validity, by_rows, filled, below, first, last):
    """
    Give each rejected pixel the smaller label of the nearest two in its column.

    by_rows: (R, C), what stands in for an end that the column does not have; below: (C,), working
    memory; first, last: columns.
    """
    rows, columns = len(labels), last - first
    copy_row(by_rows[0, first:last], filled[0, first:last])
    for row in range(1, rows):
        line, above = filled[row, first:last], filled[row - 1, first:last]
        ours, theirs = labels[row, first:last], labels[row - 1, first:last]
        our_validity, their_validity = validity[row, first:last], validity[row - 1, first:last]
        for column in range(columns):
            if our_validity[column] != INVALID:
                line[column] = ours[column]
            elif their_validity[column] != INVALID:
                line[column] = theirs[column]
            else:
                line[column] = above[column]
    under = below[first:last]
    copy_row(by_rows[rows - 1, first:last], under)
    for row in range(rows - 1, -1, -1):
        line, ours, our_validity = (filled[row, first:last], labels[row, first:last],
                                    validity[row, first:last])
        for column in range(columns):
            if our_validity[column] != INVALID:
                under[column] = ours[column]
            else:
                line[column] = min(line[column], under[column])
