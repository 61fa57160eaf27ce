# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Whether what is seen of a region speaks for moving it to another plane."""
from fuzzy_stereo_ros.matching.kernels.compiled import kernel
from fuzzy_stereo_ros.matching.kernels.refinement.consistency import root
import numpy as np


@kernel
def reject_bent(planes, starts, pixels, disparities, trusted, near, share, selected):
    """
    Reject regions of which too few trusted pixels lie near their planes.

    planes: float32 (n, 3); starts, pixels: of region i, pixels[starts[i]:starts[i + 1]]; near: px;
    share: of the trusted pixels; disparities: float32 (R, C), px; trusted: bool (R, C); selected:
    bool (R, C), set to false in regions that are rejected
    """
    columns = selected.shape[1]
    for region in range(planes.shape[0]):
        slope, fall, offset = planes[region]
        mine = pixels[starts[region]:starts[region + 1]]
        known = agreeing = 0
        for pixel in mine:
            row, column = pixel // columns, pixel % columns
            if trusted[row, column]:
                known += 1
                agreeing += abs(slope * np.float32(column) + fall * np.float32(row) + offset
                                - disparities[row, column]) < near
        if agreeing < share * max(known, 1):
            for pixel in mine:
                selected[pixel // columns, pixel % columns] = False


@kernel
def reject_unfounded(labels, old, new, far, old_costs, new_costs, trusted, price, least, region,
                     parent, excess, size, selected):
    """
    Reject regions that a proposal moves although the images speak against it.

    A region is what is 4-connected, of one label, and moves by more than `far` px. It may move if
    its trusted pixels do not cost more, in sum, than `price` for each pixel that is not trusted;
    or if it is smaller than `least` px.

    labels: int32 (R, C); old, new: float32 (R, C), px; old_costs, new_costs: int (R, C), without
    smoothness; trusted: bool (R, C); region: int32 (R, C), parent, size: int32, excess: int64
    (R * C + 1,), memory; selected: bool (R, C), set to false in regions that are rejected
    """
    rows, columns = selected.shape
    known = 1
    for row in range(rows):
        for column in range(columns):
            region[row, column] = 0
            if not selected[row, column] or not abs(new[row, column] - old[row, column]) > far:
                continue
            left = above = 0
            if column > 0 and labels[row, column - 1] == labels[row, column]:
                left = region[row, column - 1]
            if row > 0 and labels[row - 1, column] == labels[row, column]:
                above = region[row - 1, column]
            left, above = root(parent, left) if left else 0, root(parent, above) if above else 0
            mine = min(left, above) if left and above else max(left, above)
            if mine == 0:
                mine = known
                parent[mine], excess[mine], size[mine] = mine, 0, 0
                known += 1
            other = max(left, above)
            if other != mine:
                parent[other] = mine
                excess[mine] += excess[other]
                size[mine] += size[other]
            region[row, column] = mine
            size[mine] += 1
            excess[mine] += (np.int64(new_costs[row, column]) - old_costs[row, column]
                             if trusted[row, column] else -np.int64(price))
    for row in range(rows):
        for column in range(columns):
            if region[row, column] > 0:
                mine = root(parent, region[row, column])
                if excess[mine] > 0 and size[mine] >= least:
                    selected[row, column] = False
