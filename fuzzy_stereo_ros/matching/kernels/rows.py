# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Copy a row, and repeat the border of an image around it."""
from fuzzy_stereo_ros.matching.kernels.compiled import called


@called
def copy_row(source, target):
    """Copy len(target) elements; faster, and compiled sooner, than to assign a slice."""
    for column in range(len(target)):
        target[column] = source[column]


@called
def pad_row(padded, row, columns, margin):
    """Repeat the border pixels of a row into its margin and slack, border rows above and below."""
    rows, line = padded.shape[0] - 2 * margin, padded[row + margin]
    line[:margin] = line[margin]
    line[columns + margin:] = line[columns + margin - 1]
    for edge in range(margin):
        if row == 0:
            copy_row(line, padded[edge])
        if row == rows - 1:
            copy_row(line, padded[rows + margin + edge])
