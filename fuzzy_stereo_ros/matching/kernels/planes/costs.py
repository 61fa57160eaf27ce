# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The cost of genes that are planes.

Not in the paper, whose genes are whole disparities. A gene is measured over a support that
follows its own plane (Bleyer et al., PatchMatch stereo, 2011), and by how much the planes of
neighbours differ at both of them (Olsson et al., In defense of 3D-label stereo, 2013). A region
changes its plane only if its visible matches get no worse.
"""
from typing import NamedTuple

from fuzzy_stereo_ros.matching.kernels.compiled import inlined, kernel
from fuzzy_stereo_ros.matching.kernels.planes.fits import colours_apart, disparity_at, plane_at
from fuzzy_stereo_ros.matching.kernels.union_find import join, root
import numpy as np

UNIT = 1024          # the cost of an impossible match; all costs are whole numbers
TRUSTED = 256        # the trust in a match that counts in full
IMPOSSIBLE = 255     # the cost of an impossible match in a volume
_BEYOND = 128        # the least that a match beyond the other image costs in a volume
LARGEST_DIFFERENCE = np.float32(3)      # px of neighbours' planes that counts


class Volume(NamedTuple):
    """
    The costs of all matches of the left image's pixels, and where a view has its own among them.

    Column x of the mirrored right view has its match of label d in column origin - x + d of the
    left image.
    """

    costs: np.ndarray        # uint8 (R, C, labels), 0 to IMPOSSIBLE
    origin: int              # of the mirrored right view; 0 for the left one
    column_step: int         # columns for each label: 1 for the mirrored right view, else 0


class Supports(NamedTuple):
    """The weights of the pixels around each pixel over which its plane is measured."""

    stride: int              # px from neighbour to neighbour
    weights: np.ndarray      # uint8 (R, C, side, side), 0 outside the image
    masses: np.ndarray       # uint16 (R, C), their sums


@kernel
def fill_supports(colours, by_colour, by_distance, share, supports, first, last):
    """
    Weigh the neighbours of each pixel by colour, distance and a share, and sum the weights.

    by_colour: float32 (766,), by the sum of differences of the channels; by_distance: float32
    (side,), by rows or columns; share: float32 (R, C), 0 to 1, of each neighbour
    """
    stride, weights, masses = supports
    (rows, columns), side = masses.shape, by_distance.size
    radius = side // 2
    for row in range(first, last):
        for column in range(columns):
            mass = 0
            for down in range(side):
                for right in range(side):
                    y = row + (down - radius) * stride
                    x = column + (right - radius) * stride
                    weight = np.uint8(0)
                    if 0 <= y < rows and 0 <= x < columns:
                        unlike = colours_apart(colours, row, column, y, x)
                        weight = np.uint8(by_colour[unlike] * by_distance[down]
                                          * by_distance[right] * share[y, x]
                                          + np.float32(0.5))
                    weights[row, column, down, right] = weight
                    mass += weight
            masses[row, column] = mass


@inlined
def _cost_at(volume, row, column, label, column_step):
    """Return the cost of a match; column_step: columns that its place moves by for each label."""
    columns = volume.shape[1]
    place = column + column_step * label
    if place < columns and place >= 0:
        return np.float32(volume[row, place, label])
    inside = label - (place - columns + 1)
    if place < 0 or inside < 0:
        return np.float32(_BEYOND)
    return max(np.float32(volume[row, columns - 1, inside]), np.float32(_BEYOND))


@kernel
def plane_costs(volume, disparities, supports, selected, parent, first, last):
    """Write the costs of the planes of the selected pixels over their supports, 0 to UNIT."""
    volume, origin, column_step = volume
    stride, weights, masses = supports
    planes, costs = parent
    (rows, columns), side = selected.shape, weights.shape[2]
    radius, direction = side // 2, 1 - 2 * column_step
    reach = radius * stride
    labels, flat, weights = volume.shape[2], volume.reshape(-1), weights.reshape(-1)
    step = 1 + column_step * labels
    top, half = np.float32(disparities - 1), np.float32(0.5)
    for row in range(first, last):
        for column in range(columns):
            if not selected[row, column]:
                continue
            plane = slope, fall, _ = plane_at(planes, row, column)
            total = np.float32(0)
            begin, end = column - reach, column + reach
            middle = disparity_at(plane, column, row)
            spread = (abs(slope) + abs(fall)) * np.float32(reach) + np.float32(1)
            least, most = middle - spread, middle + spread
            nearest = origin + column_step * np.int64(min(max(least, -half), top))
            farthest = origin + column_step * np.int64(min(max(most, -half), top))
            inside = (least >= 0 and most < top and begin >= 0 and end < columns
                      and row >= reach and row + reach < rows
                      and (column_step == 0
                           or (nearest - end > 0 and farthest - begin < columns - 2)))
            for down in range(max(radius - row // stride, 0),
                              min(side, (rows - 1 - row) // stride + radius + 1)):
                y = row + (down - radius) * stride
                disparity = disparity_at(plane, begin, y)
                weight_at = ((row * columns + column) * side + down) * side
                if inside:
                    place = (y * columns + origin + direction * begin) * labels
                    for right in range(side):
                        label = np.int64(disparity)
                        here = np.uint64(place + label * step)
                        low = np.float32(flat[here])
                        high = np.float32(flat[here + np.uint64(step)])
                        weight = np.float32(weights[np.uint64(weight_at + right)])
                        total += weight * (low + (disparity - np.float32(label)) * (high - low))
                        place += direction * stride * labels
                        disparity += slope * np.float32(stride)
                    continue
                x = begin
                for right in range(side):
                    weight = np.float32(weights[weight_at + right])
                    if weight > 0:
                        if disparity < -half or disparity > top + half:
                            total += weight * np.float32(IMPOSSIBLE)
                        else:
                            within = min(max(disparity, np.float32(0)), top)
                            label = np.int64(within)
                            share = within - np.float32(label)
                            cost = _cost_at(volume, y, origin + direction * x, label, column_step)
                            if share > 0:
                                cost += share * (_cost_at(volume, y, origin + direction * x,
                                                          label + 1, column_step) - cost)
                            total += weight * cost
                    x += stride
                    disparity += slope * np.float32(stride)
            costs[row, column] = np.int32(
                total / np.float32(masses[row, column]) * np.float32(UNIT / IMPOSSIBLE) + half)


@inlined
def bend(one, row, column, other, y, x, weight):
    """
    Return the cost of the difference of two neighbours' planes at both places.

    one, other: the planes of (row, column) and (y, x); weight: UNITs a px
    """
    apart = one[0] - other[0], one[1] - other[1], one[2] - other[2]
    here, there = abs(disparity_at(apart, column, row)), abs(disparity_at(apart, x, y))
    return np.int32(weight * min(here + there, LARGEST_DIFFERENCE))


@kernel
def smoothness(planes, weights, row_sums, first, last):
    """
    Write the costs of the differences of neighbours: int64 (R,), the sums of rows.

    weights: float32 (2, R, C), UNITs a px, of those to the left and the upper neighbour
    """
    for row in range(first, last):
        total = np.int64(0)
        for column in range(planes.shape[2]):
            one = plane_at(planes, row, column)
            for side in range(2):
                y, x = row - side, column - 1 + side
                if y >= 0 and x >= 0:
                    total += bend(one, row, column, plane_at(planes, y, x), y, x,
                                  weights[side, row, column])
        row_sums[row] = total


@kernel(allocates=True)
def fill_exchange(first, second, weights, changes):
    """
    Write the changes of cost of taking the second parent's planes: see crossover.Exchange.

    first, second: planes, and costs of their matches, int (R, C); weights: of smoothness
    """
    cells, alone, pairs = changes
    (first_planes, first_costs), (second_planes, second_costs) = first, second
    rows, columns = first_costs.shape
    numbers = np.full((rows, columns), -1, np.int32)
    for number in range(cells.size):
        numbers[cells[number] // columns, cells[number] % columns] = number
    for number in range(cells.size):
        row, column = cells[number] // columns, cells[number] % columns
        one, new = plane_at(first_planes, row, column), plane_at(second_planes, row, column)
        alone[number] = second_costs[row, column] - first_costs[row, column]
        for side in range(2):
            # with the left and the upper one, then with the right and the lower one
            y, x = row - side, column - 1 + side
            pairs[number, side] = 0
            if y >= 0 and x >= 0:
                weight, other = weights[side, row, column], plane_at(first_planes, y, x)
                old = bend(one, row, column, other, y, x, weight)
                mixed = bend(new, row, column, other, y, x, weight)
                alone[number] += mixed - old
                if numbers[y, x] >= 0:
                    newer = plane_at(second_planes, y, x)
                    remixed = bend(one, row, column, newer, y, x, weight)
                    both = bend(new, row, column, newer, y, x, weight)
                    alone[numbers[y, x]] += remixed - old
                    pairs[number, side] = both + old - mixed - remixed
            y, x = row + side, column + 1 - side
            if y < rows and x < columns and numbers[y, x] < 0:
                weight, other = weights[side, y, x], plane_at(first_planes, y, x)
                alone[number] += (bend(new, row, column, other, y, x, weight)
                                  - bend(one, row, column, other, y, x, weight))


FAR = np.float32(0.5)        # px by which a region that moves needs evidence
PRICE = int(0.2 * UNIT)      # of cost that it may gain for each pixel that the views disagree on
LEAST = 100                  # number of its pixels


@kernel(allocates=True)
def reject_unfounded(labels, old, new, trusted, selected):
    """
    Reject regions that a proposal moves although their visible matches get worse.

    A region is what is 4-connected, of one label, and moves far. It may move if its trusted pixels
    do not cost more, in sum, than the price of those that are not trusted; or if it is small.

    labels: int32 (R, C); old, new: disparities, float32 (R, C), px, and costs without smoothness;
    selected: bool (R, C), set to false in regions that are rejected
    """
    (old, old_costs), (new, new_costs) = old, new
    rows, columns = selected.shape
    region = np.empty((rows, columns), np.int32)    # numbers from 1 on; 0 is none, its parent 0
    parent, size = np.empty(selected.size + 1, np.int32), np.empty(selected.size + 1, np.int32)
    excess = np.empty(selected.size + 1, np.int64)  # that trusted pixels gain over the price
    parent[0], known = 0, 1
    for row in range(rows):
        for column in range(columns):
            region[row, column] = 0
            if not selected[row, column] or not abs(new[row, column] - old[row, column]) > FAR:
                continue
            left = above = 0
            if column > 0 and labels[row, column - 1] == labels[row, column]:
                left = region[row, column - 1]
            if row > 0 and labels[row - 1, column] == labels[row, column]:
                above = region[row - 1, column]
            mine, other = join(parent, left if left else above, above if above else left)
            if mine == 0:
                mine = known
                parent[mine], excess[mine], size[mine] = mine, 0, 0
                known += 1
            elif other != mine:
                excess[mine] += excess[other]
                size[mine] += size[other]
            region[row, column] = mine
            size[mine] += 1
            excess[mine] += (np.int64(new_costs[row, column]) - old_costs[row, column]
                             if trusted[row, column] else -np.int64(PRICE))
    for row in range(rows):
        for column in range(columns):
            if region[row, column] > 0:
                mine = root(parent, region[row, column])
                if excess[mine] > 0 and size[mine] >= LEAST:
                    selected[row, column] = False
