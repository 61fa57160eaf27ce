# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Fill refused pixels from the background: the farther of the nearest two on the row."""
from fuzzy_stereo_ros.matching.kernels.consistency import REFUSED
from numba import njit


@njit(nogil=True, cache=True)
def fill_rows(labels, verdict, filled, first, last):
    """
    Copy the labels and give each refused run the smaller label of its two ends.

    A row without any label takes that of the row above, or 0 in the first row of the band.
    """
    columns = labels.shape[1]
    for row in range(first, last):
        known = -1
        for column in range(columns):
            if verdict[row, column] == REFUSED:
                continue
            label = labels[row, column]
            if known < column - 1:
                background = label if known < 0 else min(label, labels[row, known])
                filled[row, known + 1:column] = background
            filled[row, column] = label
            known = column
        if known < 0:
            for column in range(columns):
                filled[row, column] = filled[row - 1, column] if row > first else 0
        else:
            filled[row, known + 1:columns] = labels[row, known]


@njit(nogil=True, cache=True)
def fill_columns(labels, verdict, by_rows, filled, below):
    """
    Give each refused pixel the smaller label of the nearest two in its column.

    by_rows: (R, C), what stands in for an end that the column does not have; below: (C,), working
    memory.
    """
    rows, columns = labels.shape
    for column in range(columns):
        filled[0, column] = by_rows[0, column]
    for row in range(1, rows):
        for column in range(columns):
            if verdict[row, column] != REFUSED:
                filled[row, column] = labels[row, column]
            elif verdict[row - 1, column] != REFUSED:
                filled[row, column] = labels[row - 1, column]
            else:
                filled[row, column] = filled[row - 1, column]
    for column in range(columns):
        below[column] = by_rows[rows - 1, column]
    for row in range(rows - 1, -1, -1):
        for column in range(columns):
            if verdict[row, column] != REFUSED:
                below[column] = labels[row, column]
            else:
                filled[row, column] = min(filled[row, column], below[column])


@njit(nogil=True, cache=True)
def take_trusted(labels, previous, weights, taken):
    """Copy a map, with the previous best's genes where they are leant on: all (R, C)."""
    for row in range(labels.shape[0]):
        for column in range(labels.shape[1]):
            taken[row, column] = previous[row, column] if weights[row, column] > 0 \
                else labels[row, column]
