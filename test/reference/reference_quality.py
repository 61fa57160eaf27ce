# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Plain twins of the kernels of the profile quality, one cell at a time."""
from fuzzy_stereo_ros.matching.kernels.possibility import fuzzy_costs
import numpy as np
from reference import windows

FULL = fuzzy_costs.FULL


def census(fine, radius):
    """Return the codes, uint16 (R, 2, C), of fine grey with repeated borders."""
    inner = np.s_[radius:-radius, radius:-radius]
    darker = windows(fine, radius)[inner] < fine[inner][..., np.newaxis]
    darker = np.delete(darker, darker.shape[2] // 2, axis=2)
    codes = darker @ 2**np.arange(darker.shape[2])
    return np.stack([codes & 65535, codes >> 16], axis=1).astype(np.uint16)


def costs(codes, target_codes, planes, target_planes, weights, disparities, first_inside, labels):
    """Return the costs of all matches; the target's arrays are not mirrored here."""
    rows, columns, channels = codes.shape[0], codes.shape[2], fuzzy_costs.CHANNELS
    column, label = np.mgrid[:columns, :disparities]
    seen = np.maximum(column - label, np.clip(first_inside, 0, column))
    one, other = planes[..., np.newaxis].astype(int), target_planes.astype(int)[..., seen]
    differing = codes[..., np.newaxis] ^ target_codes[..., seen]
    exponent = weights[0] * sum((differing >> bit & 1).sum(axis=1, dtype=int) for bit in range(16))
    for channel in range(channels):
        low, high = fuzzy_costs.LOW + channel, fuzzy_costs.HIGH + channel
        forth, back = (np.maximum(a[:, channel] - b[:, high], b[:, low] - a[:, channel])
                       for a, b in ((one, other), (other, one)))
        exponent += np.minimum(forth, back).clip(0) * weights[1 + (channel == channels - 1)]
    gradients = slice(fuzzy_costs.GRADIENT, fuzzy_costs.GRADIENT + 2)
    exponent += weights[3] * abs(one[:, gradients] - other[:, gradients]).sum(axis=1)
    exponent = np.minimum(exponent, fuzzy_costs.UNIT * fuzzy_costs.SHARPNESS - 1)
    possible = 65535 - exponent * fuzzy_costs.SHARPNESS
    for _ in range(4):
        possible = possible * possible >> 16
    result = np.full((rows, columns, labels), FULL)
    cost = FULL - (possible >> 7)
    result[..., :disparities] = np.where(
        column - label >= first_inside, cost, np.maximum(cost, FULL // 2))
    return result


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
    if axis == 0:
        return mean_over_arms(costs.swapaxes(0, 1), arms.swapaxes(0, 1)[..., 2:], 1).swapaxes(0, 1)
    result = np.zeros_like(costs)
    for row, column in np.ndindex(costs.shape[:2]):
        before, after = arms[row, column, :2]
        cells = costs[row, column - before:column + after + 1].astype(int)
        number, total = len(cells), cells.sum(axis=0)
        result[row, column] = total if number == 1 else \
            (total + number // 2) * (65536 // number) >> 16
    return result


def summed_paths(costs, parent, steepest, steps, small, jump, upwards):
    """Return the sums of the four paths of the way down, or of the way up."""
    rows, columns, labels = costs.shape
    sums, sign = np.zeros(costs.shape, int), -1 if upwards else 1
    for plane, (down, right) in enumerate(((0, 1), (1, 1), (1, 0), (1, -1))):
        path = costs.astype(int)
        for row, column in list(np.ndindex(rows, columns))[::sign]:
            y, x = row - sign * down, column - sign * right
            if not (0 <= y < rows and 0 <= x < columns):
                continue
            step = steps[plane, y, x] if upwards else steps[plane, row, column]
            shift = int(parent[row, column]) - int(parent[y, x])
            shift = 0 if abs(shift) > steepest else shift
            before, least = path[y, x], path[y, x].min()
            options = np.full((4, labels), least + int(jump[step]))
            for beside, price in ((0, 0), (-1, int(small[step])), (1, int(small[step]))):
                near = np.arange(labels) - shift + beside
                there = (near >= 0) & (near < labels)
                options[beside, there] = before[near[there]] + price
            path[row, column] += options.min(axis=0) - least
        sums += path
    return sums


def chosen_labels(sums, disparities, extra):
    """Return labels, offsets, margins and the target's labels, from its column -extra on."""
    rows, columns = sums.shape[:2]
    labels, margins = (np.zeros((rows, columns), int) for _ in range(2))
    offsets, target = np.zeros((rows, columns), np.float32), np.zeros((rows, extra + columns), int)
    best = np.full(target.shape, 65535)
    for row, column in np.ndindex(rows, columns):
        cell = sums[row, column, :disparities]
        label = labels[row, column] = cell.argmin()
        others = cell[abs(np.arange(disparities) - label) > 1]
        margins[row, column] = min([*others, 65535]) - cell[label]
        if 0 < label < disparities - 1:
            rise = max(cell[label - 1], cell[label + 1]) - cell[label]
            if rise > 0:
                offset = (cell[label - 1] - cell[label + 1]) / (2 * rise)
                offsets[row, column] = np.sign(offset) * abs(2 * offset)**0.8 / 2
        for rival in range(min(disparities, extra + column + 1)):
            pointed = row, extra + column - rival
            if cell[rival] <= best[pointed]:
                best[pointed], target[pointed] = cell[rival], rival
    return labels, offsets, margins, target


def weighted_median(disparities, selected, colours, radius, by_colour, by_distance, bins):
    """Return the map with the weighted medians of the selected pixels."""
    rows, columns = disparities.shape
    result, signed = disparities.copy(), colours.astype(int)
    for row, column in np.argwhere(selected):
        y, x = np.mgrid[max(row - radius, 0):min(row + radius + 1, rows),
                        max(column - radius, 0):min(column + radius + 1, columns)]
        weights = by_colour[abs(signed[y, x] - signed[row, column]).sum(axis=2)] * by_distance[
            y - row + radius] * by_distance[x - column + radius]
        places, order = np.unique(
            (disparities[y, x] * bins + 0.5).astype(int), return_inverse=True)
        shares = np.bincount(order.ravel(), weights.ravel()).cumsum()
        result[row, column] = places[np.searchsorted(shares, shares[-1] / 2)] / bins
    return result


def local_planes(disparities, colours, radius, by_colour, limit, growth):
    """Return the map of local planes, by weighted least squares with a slight pull to flat."""
    rows, columns = disparities.shape
    result, signed = np.zeros(disparities.shape), colours.astype(int)
    for row, column in np.ndindex(rows, columns):
        y, x = np.mgrid[max(row - radius, 0):min(row + radius + 1, rows),
                        max(column - radius, 0):min(column + radius + 1, columns)]
        away = np.maximum(abs(y - row), abs(x - column))
        difference = disparities[y, x] - disparities[row, column]
        weights = (abs(difference) <= limit * (1 + growth * away)) * by_colour[
            abs(signed[y, x] - signed[row, column]).sum(axis=2)].astype(float)
        places = np.stack([np.ones(y.shape), x - column, y - row])
        normal = np.diag([0.0, 1.0, 1.0]) + np.einsum('iyx,jyx,yx', places, places, weights)
        offset = np.linalg.solve(normal, (places * weights * difference).sum(axis=(1, 2)))[0]
        result[row, column] = disparities[row, column] + np.clip(offset, -1, 1)
    return result


def surface_cost(surface, gene_costs, across, down, rules):
    """Return what a map costs: its matches, float (R, C), and its steps, each in whole parts."""
    total = float(gene_costs.sum())
    for axis, weights in enumerate((down, across)):
        steps = abs(np.diff(surface, axis=axis))
        costs = np.minimum(np.maximum(steps - rules.FREE, np.float32(0)) * rules.SLOPE, rules.JUMP)
        costs = np.delete(weights, 0, axis) * costs
        total += np.rint(rules.COST_PARTS * costs.astype(float)).sum() / rules.COST_PARTS
    return total
