# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Plain twins of the kernels of the profile quality, one cell at a time."""
from fuzzy_stereo_ros.matching.kernels.possibility import fuzzy_costs
import numpy as np

FULL = fuzzy_costs.FULL


def census(fine, radius):
    """Return the codes, uint16 (R, 2, C), of fine grey with repeated borders."""
    rows, columns = (size - 2 * radius for size in fine.shape)
    codes = np.zeros((rows, 2, columns), np.uint16)
    for row, column in np.ndindex(rows, columns):
        bit = 0
        for down, right in np.ndindex(2 * radius + 1, 2 * radius + 1):
            if (down, right) == (radius, radius):
                continue
            darker = fine[row + down, column + right] < fine[row + radius, column + radius]
            codes[row, bit // 16, column] |= np.uint16(int(darker) << bit % 16)
            bit += 1
    return codes


def match_cost(here, there, weights):
    """Return the cost of two pixels, each (codes, planes), both lists of whole numbers."""
    distance = sum(bin(one ^ other).count('1') for one, other in zip(here[0], there[0]))
    exponent = distance * weights[0]
    one, other, channels = here[1], there[1], fuzzy_costs.CHANNELS
    for channel in range(channels):
        low, high = fuzzy_costs.LOW + channel, fuzzy_costs.HIGH + channel
        forth = max(one[channel] - other[high], other[low] - one[channel], 0)
        back = max(other[channel] - one[high], one[low] - other[channel], 0)
        exponent += min(forth, back) * weights[1 if channel < channels - 1 else 2]
    across, down = fuzzy_costs.GRADIENT, fuzzy_costs.GRADIENT + 1
    exponent += weights[3] * (abs(one[across] - other[across]) + abs(one[down] - other[down]))
    exponent = min(exponent, fuzzy_costs.UNIT * fuzzy_costs.SHARPNESS - 1)
    possible = 65535 - exponent * fuzzy_costs.SHARPNESS
    for _ in range(4):
        possible = possible * possible >> 16
    return FULL - (possible >> 7)


def costs(codes, target_codes, planes, target_planes, weights, disparities, first_inside, labels):
    """Return the costs of all matches; the target's arrays are not mirrored here."""
    rows, columns = codes.shape[0], codes.shape[2]
    result = np.full((rows, columns, labels), FULL)
    for row, column, label in np.ndindex(rows, columns, disparities):
        inside = column - label >= first_inside
        seen = max(column - label, min(first_inside, column), 0)
        cost = match_cost(
            (codes[row, :, column].tolist(), planes[row, :, column].tolist()),
            (target_codes[row, :, seen].tolist(), target_planes[row, :, seen].tolist()),
            weights)
        result[row, column, label] = cost if inside else max(cost, FULL // 2)
    return result


def costs_with_prior(costs, surface, weights, dead_zone, cut):
    """Return costs to which a prior is added, to within a unit of rounding."""
    labels = np.arange(costs.shape[2])
    away = np.clip(abs(labels - surface[..., np.newaxis]) - dead_zone, 0, cut)
    return costs + weights[..., np.newaxis] * away


def arms(colours, longest, near, alike, much_alike, surface, level):
    """Return the arms, (R, C, 4): left, right, up, down."""
    rows, columns = colours.shape[:2]
    signed, result = colours.astype(int), np.zeros((rows, columns, 4), int)
    for row, column in np.ndindex(rows, columns):
        for arm, (down, right) in enumerate(((0, -1), (0, 1), (-1, 0), (1, 0))):
            for step in range(1, longest + 1):
                y, x = row + step * down, column + step * right
                if not (0 <= y < rows and 0 <= x < columns):
                    break
                from_centre = abs(signed[y, x] - signed[row, column]).max()
                from_last = abs(signed[y, x] - signed[y - down, x - right]).max()
                if (max(from_centre, from_last) >= alike
                        or step > near and from_centre >= much_alike
                        or abs(surface[y, x] - surface[row, column]) > level):
                    break
                result[row, column, arm] = step
    return result


def mean_over_arms(costs, arms, axis):
    """Return the means of costs, (R, C, labels), over the row arms (axis 1) or column arms (0)."""
    result = np.zeros_like(costs)
    for row, column in np.ndindex(costs.shape[:2]):
        before, after = arms[row, column, :2] if axis == 1 else arms[row, column, 2:]
        cells = costs[row, column - before:column + after + 1] if axis == 1 else \
            costs[row - before:row + after + 1, column]
        number = len(cells)
        total = cells.astype(int).sum(axis=0)
        result[row, column] = total if number == 1 else \
            (total + number // 2) * (65536 // number) >> 16
    return result


def summed_paths(costs, parent, steepest, steps, small, jump, upwards):
    """Return the sums of the four paths of the way down, or of the way up."""
    rows, columns, labels = costs.shape
    sums = np.zeros(costs.shape, int)
    for plane, (down, right) in enumerate(((0, 1), (1, 1), (1, 0), (1, -1))):
        if upwards:
            down, right = -down, -right
        path = np.zeros(costs.shape, int)
        for row in range(rows)[::-1 if upwards else 1]:
            for column in range(columns)[::-1 if upwards else 1] if plane == 0 else range(columns):
                y, x = row - down, column - right
                path[row, column] = costs[row, column]
                if not (0 <= y < rows and 0 <= x < columns):
                    continue
                step = steps[plane, y, x] if upwards else steps[plane, row, column]
                shift = int(parent[row, column]) - int(parent[y, x])
                shift = 0 if abs(shift) > steepest else shift
                before, least = path[y, x], path[y, x].min()
                for label in range(labels):
                    options = [least + int(jump[step])]
                    for beside, price in ((0, 0), (-1, int(small[step])), (1, int(small[step]))):
                        if 0 <= label - shift + beside < labels:
                            options.append(before[label - shift + beside] + price)
                    path[row, column, label] += min(options) - least
        sums += path
    return sums


def chosen_labels(sums, disparities):
    """Return labels, offsets, margins and the target's labels."""
    rows, columns = sums.shape[:2]
    labels, target, margins = (np.zeros((rows, columns), int) for _ in range(3))
    offsets = np.zeros((rows, columns), np.float32)
    best = np.full((rows, columns), 65535)
    for row, column in np.ndindex(rows, columns):
        cell = sums[row, column, :disparities]
        label = labels[row, column] = cell.argmin()
        others = np.delete(cell, [near for near in (label - 1, label, label + 1)
                                  if 0 <= near < disparities])
        margins[row, column] = min([*others, 65535]) - cell[label]
        if 0 < label < disparities - 1:
            rise = max(cell[label - 1], cell[label + 1]) - cell[label]
            if rise > 0:
                offset = (cell[label - 1] - cell[label + 1]) / (2 * rise)
                offsets[row, column] = np.sign(offset) * abs(2 * offset)**0.8 / 2
        for rival in range(min(disparities, column + 1)):
            if cell[rival] <= best[row, column - rival]:
                best[row, column - rival] = cell[rival]
                target[row, column - rival] = rival
    return labels, offsets, margins, target


def weighted_median(disparities, selected, colours, radius, by_colour, by_distance, bins):
    """Return the map with the weighted medians of the selected pixels."""
    rows, columns = disparities.shape
    result, signed = disparities.copy(), colours.astype(int)
    for row, column in np.argwhere(selected):
        weights = {}
        for y in range(max(row - radius, 0), min(row + radius + 1, rows)):
            for x in range(max(column - radius, 0), min(column + radius + 1, columns)):
                place = int(disparities[y, x] * bins + 0.5)
                weights[place] = weights.get(place, 0) + (
                    by_colour[abs(signed[y, x] - signed[row, column]).sum()]
                    * by_distance[y - row + radius] * by_distance[x - column + radius])
        share, half = 0, sum(weights.values()) / 2
        for place in sorted(weights):
            share += weights[place]
            if share >= half:
                result[row, column] = place / bins
                break
    return result


def local_planes(disparities, colours, radius, by_colour, limit, growth):
    """Return the map of local planes, by weighted least squares with a slight pull to flat."""
    rows, columns = disparities.shape
    result, signed = np.zeros(disparities.shape), colours.astype(int)
    for row, column in np.ndindex(rows, columns):
        normal, right_side = np.diag([0.0, 1.0, 1.0]), np.zeros(3)
        for y in range(max(row - radius, 0), min(row + radius + 1, rows)):
            for x in range(max(column - radius, 0), min(column + radius + 1, columns)):
                away = max(abs(y - row), abs(x - column))
                difference = float(disparities[y, x] - disparities[row, column])
                if abs(difference) > limit * (1 + growth * away):
                    continue
                weight = by_colour[abs(signed[y, x] - signed[row, column]).sum()]
                place = np.array([1, x - column, y - row])
                normal += weight * np.outer(place, place)
                right_side += weight * difference * place
        offset = np.linalg.solve(normal, right_side)[0]
        result[row, column] = disparities[row, column] + np.clip(offset, -1, 1)
    return result


def cost_at(cell, disparity, disparities):
    """Return the cost of a disparity between those of its labels, (labels,)."""
    known = cell[:disparities].astype(float)
    return np.interp(disparity, np.arange(disparities), known)


def surface_cost(surface, gene_costs, across, down, rules):
    """Return what a map costs: its matches, float (R, C), and its steps, each in whole parts."""
    total = float(gene_costs.sum())
    for axis, weights in enumerate((down, across)):
        steps = abs(np.diff(surface, axis=axis))
        costs = np.minimum(np.maximum(steps - rules.FREE, np.float32(0)) * rules.SLOPE, rules.JUMP)
        costs = np.delete(weights, 0, axis) * costs
        total += np.rint(rules.COST_PARTS * costs.astype(float)).sum() / rules.COST_PARTS
    return total
