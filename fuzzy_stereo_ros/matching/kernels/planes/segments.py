# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Segments of like pixels.

After Felzenszwalb and Huttenlocher, Efficient graph-based image segmentation, 2004.
"""
from fuzzy_stereo_ros.matching.kernels.compiled import kernel
from fuzzy_stereo_ros.matching.kernels.refinement.consistency import root
import numpy as np

PARTS = 16           # differences of pixels are counted in such parts of 1
LEVELS = 2**13       # differences from here on count alike


@kernel
def sort_edges(values, differences, starts, order):
    """
    Write the pairs of neighbours by ascending difference of their values.

    values: float32 (R, C, 3); differences: int16 (2 * R * C,), memory: of pixel p with its left
    neighbour at 2 p, with the upper one at 2 p + 1, -1 for none; starts: int32 (LEVELS + 1,),
    memory; order: int32 (2 * R * C,); returns how many pairs there are.
    """
    rows, columns = values.shape[:2]
    starts[:] = 0
    for row in range(rows):
        for column in range(columns):
            for side in range(2):
                y, x = row - side, column - 1 + side
                edge = 2 * (row * columns + column) + side
                differences[edge] = -1
                if y >= 0 and x >= 0:
                    total = np.float32(0)
                    for channel in range(3):
                        apart = values[row, column, channel] - values[y, x, channel]
                        total += apart * apart
                    level = min(np.int64(np.sqrt(total) * PARTS + np.float32(0.5)), LEVELS - 1)
                    differences[edge] = level
                    starts[level + 1] += 1
    for level in range(LEVELS):
        starts[level + 1] += starts[level]
    number = starts[LEVELS]
    for edge in range(2 * rows * columns):
        level = differences[edge]
        if level >= 0:
            order[starts[level]] = edge
            starts[level] += 1
    return number


@kernel
def _neighbour(edge, columns):
    """Return the pixel that an edge leads to from pixel edge // 2."""
    return edge // 2 - (columns if edge % 2 else 1)


@kernel
def join_pixels(order, differences, columns, scale, smallest, parent, size, inner, labels):
    """
    Join pixels to segments; return how many there are.

    order, differences: of sort_edges; scale: px times grey levels, larger ones make larger
    segments; smallest: px; parent, size: int32 (R * C,), inner: float32 (R * C,), memory; labels:
    int32 (R * C,), from 0, in the order of the segments' first pixels
    """
    for pixel in range(labels.size):
        parent[pixel], size[pixel], inner[pixel] = pixel, 1, 0
    for few in range(2):
        for edge in order:
            one, other = root(parent, edge // 2), root(parent, _neighbour(edge, columns))
            if one == other:
                continue
            if few:
                join = min(size[one], size[other]) < smallest
            else:
                apart = np.float32(differences[edge]) / np.float32(PARTS)
                join = apart <= min(inner[one] + scale / size[one],
                                    inner[other] + scale / size[other])
                if join:
                    inner[one] = apart
            if join:
                parent[other] = one
                size[one] += size[other]
    number = 0
    for pixel in range(labels.size):
        above = root(parent, pixel)
        if size[above] > 0:                  # from here on size is minus the label, minus one
            size[above] = -1 - number
            number += 1
        labels[pixel] = -1 - size[above]
    return number
