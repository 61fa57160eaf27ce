# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The cost of every match as 1 - the product of memberships of four differences.

Not in the paper, whose three grey classes do not tell pixels apart. The differences are those of
the census (Zabih and Woodfill, 1994), of colour and of its slope, both insensitive to sampling
(Birchfield and Tomasi, 1998), and of the Sobel gradient; the product of exponential memberships
is the membership of their weighted sum.

It is more reliable when averaged over the pixels of like colour along rows and columns, after
Zhang, Lu and Lafruit, Cross-based local stereo matching, 2009. Sums over arms are differences of
running sums, so that long arms cost no more than short ones. Running sums may overflow: their
differences do not.
"""
from fuzzy_stereo_ros.matching.kernels.compiled import called, inlined, kernel
from fuzzy_stereo_ros.matching.kernels.simd import (
    absolute_difference, add, bit_xor, count_bits, high_product, LANES, load, maximum, minimum,
    multiply, saturating_add, saturating_subtract, shift_right, splat, store, subtract)
import numpy as np

FULL = 512            # the cost of an impossible match
UNIT = 256            # exponents are counted in such parts of 1
SHARPNESS = 16        # (1 - x / 16)**16 stands for exp(-x)
CHANNELS = 4          # blue, green, red and the slope of grey along the row
LOW, HIGH = CHANNELS, 2 * CHANNELS      # planes of the least and greatest values half a px around
GRADIENT = 3 * CHANNELS                 # planes of the Sobel gradient along row and column
PLANES = GRADIENT + 2
_TOP = UNIT * SHARPNESS - 1
_TO_FULL = 7          # 65536 / FULL = 2**7
LEFT, RIGHT, UP, DOWN = range(4)
# Arms: px that they reach; least difference, grey levels in any channel, from the centre or the
# pixel before that ends them, and farther than NEAR from the centre; px of a parent's surface that
# are still at the level of the centre.
LONGEST, NEAR, ALIKE, MUCH_ALIKE, LEVEL = 8, 4, 14, 8, np.float32(0.4)


@kernel
def census(fine, radius, codes, first, last):
    """
    Compare the neighbours in a square with the centre: a bit each, set where darker.

    fine: float32 (R + 2 * radius, C + 2 * radius), borders repeated; codes: uint16 (R, K, C), a
    plane for 16 bits
    """
    columns = codes.shape[2]
    for row in range(first, last):
        bit = 0
        centre = fine[row + radius, radius:radius + columns]
        for down in range(2 * radius + 1):
            for right in range(2 * radius + 1):
                if down == radius and right == radius:
                    continue
                near = fine[row + down, right:right + columns]
                code, value = codes[row, bit // 16], np.uint16(1 << (bit % 16))
                for column in range(columns):
                    old = code[column] if bit % 16 > 0 else np.uint16(0)
                    code[column] = old | (value if near[column] < centre[column] else np.uint16(0))
                bit += 1


@kernel
def fill_costs(reference, target, weights, disparities, first_inside, costs, first, last):
    """
    Write the costs of all matches of some rows.

    A label that points beyond the target image costs as much as the last one inside, at least half
    of FULL: a flat neutral cost there would attract low texture such as roads.

    reference, target: uint16 (R, K + PLANES, C or C + labels), K planes of the census, and those
    of colours, slopes and gradients; of the target mirrored, the last column repeated; weights:
    uint16 (4,) of a bit, a step of colour, of slope, of gradient, in UNITs; first_inside: first
    column of the target that exists; costs: FULL for
    labels from `disparities` on
    """
    columns, labels = costs.shape[1], costs.shape[2]
    flat, flat_planes, stride = costs.reshape(-1), target.reshape(-1), target.shape[2]
    scales, of_row = target.shape[1] - PLANES, target.shape[1] * stride
    bit, colour, slope, gradient = (splat(weights[0]), splat(weights[1]), splat(weights[2]),
                                    splat(weights[3]))
    for row in range(first, last):
        code, here = reference[row], reference[row, scales:]
        for column in range(columns):
            place = (row * columns + column) * labels
            for block in range(0, labels, LANES):
                begin = row * of_row + columns - 1 - column + block
                distance = splat(np.uint16(0))
                for scale in range(scales):
                    other = load(flat_planes, scale * stride + begin)
                    distance = add(distance, count_bits(bit_xor(splat(code[scale, column]),
                                                                other)))
                exponent = multiply(distance, bit)
                begin += scales * stride
                for channel in range(CHANNELS):
                    value = splat(here[channel, column])
                    other = load(flat_planes, begin + channel * stride)
                    one = maximum(
                        saturating_subtract(value, load(flat_planes, begin + (HIGH + channel)
                                                        * stride)),
                        saturating_subtract(load(flat_planes, begin + (LOW + channel) * stride),
                                            value))
                    two = maximum(
                        saturating_subtract(other, splat(here[HIGH + channel, column])),
                        saturating_subtract(splat(here[LOW + channel, column]), other))
                    exponent = saturating_add(exponent, multiply(
                        minimum(one, two), colour if channel < CHANNELS - 1 else slope))
                unlike = add(
                    absolute_difference(splat(here[GRADIENT, column]),
                                        load(flat_planes, begin + GRADIENT * stride)),
                    absolute_difference(splat(here[GRADIENT + 1, column]),
                                        load(flat_planes, begin + (GRADIENT + 1) * stride)))
                exponent = saturating_add(exponent, multiply(unlike, gradient))
                exponent = minimum(exponent, splat(np.uint16(_TOP)))
                possible = subtract(splat(np.uint16(65535)),
                                    multiply(exponent, splat(np.uint16(SHARPNESS))))
                for _ in range(4):
                    possible = high_product(possible, possible)
                store(flat, place + block, subtract(splat(np.uint16(FULL)),
                                                    shift_right(possible, _TO_FULL)))
            cell = costs[row, column]
            outside = max(column - first_inside + 1, 0)
            if outside < labels:
                cell[outside:] = max(cell[max(outside - 1, 0)], np.uint16(FULL // 2))
            cell[disparities:] = FULL


@kernel
def add_prior(costs, surface, weights, dead_zone, cut, undo, first, last):
    """
    Make labels far from a parent's surface cost more, up to `cut` px beyond the dead zone.

    costs: uint16 (R, C, labels); surface: float32 (R, C), px; weights: float32 (R, C), what a px
    costs; undo: take back, to the last bit, what the same call without it did
    """
    columns, labels = costs.shape[1:]
    flat, reach, sign = costs.reshape(-1), dead_zone + cut, np.uint16(65535 if undo else 1)
    for row in range(first, last):
        for column in range(columns):
            weight, middle = weights[row, column], surface[row, column]
            most = np.uint16(np.uint16(weight * cut) * sign)
            cell, place = costs[row, column], (row * columns + column) * labels
            for block in range(0, labels, LANES):
                store(flat, place + block, add(load(flat, place + block), splat(most)))
            for label in range(max(np.int64(middle - reach), 0),
                               min(np.int64(middle + reach) + 2, labels)):
                away = max(abs(np.float32(label) - middle) - dead_zone, np.float32(0))
                near = np.uint16(np.uint16(weight * min(away, cut)) * sign)
                cell[label] = np.uint16(cell[label] + np.uint16(near - most))


@called
def _unlike(colours, row, column, other_row, other_column):
    """Return the largest difference of two pixels in any channel."""
    largest = 0
    for channel in range(3):
        largest = max(largest, abs(np.int64(colours[row, column, channel])
                                   - np.int64(colours[other_row, other_column, channel])))
    return largest


@kernel
def fill_arms(colours, surface, arms, first, last):
    """
    Write how many pixels each arm reaches from its centre.

    surface: float32 (R, C), px, of a parent; arms: uint8 (R, C, 4), LEFT, RIGHT, UP, DOWN
    """
    rows, columns = colours.shape[:2]
    for row in range(first, last):
        for column in range(columns):
            centre = surface[row, column]
            for arm in range(4):
                down = -1 if arm == UP else 1 if arm == DOWN else 0
                right = -1 if arm == LEFT else 1 if arm == RIGHT else 0
                reached = 0
                for step in range(1, LONGEST + 1):
                    y, x = row + step * down, column + step * right
                    if y < 0 or y >= rows or x < 0 or x >= columns:
                        break
                    difference = _unlike(colours, row, column, y, x)
                    if (difference >= ALIKE or step > NEAR and difference >= MUCH_ALIKE
                            or abs(surface[y, x] - centre) > LEVEL):
                        break
                    if _unlike(colours, y, x, y - down, x - right) >= ALIKE:
                        break
                    reached = step
                arms[row, column, arm] = reached


@inlined
def _store_mean(total, number, costs, place):
    """Write the mean of a number of costs from their totals."""
    if number > 1:
        total = high_product(add(total, splat(np.uint16(number >> 1))),
                             splat(np.uint16(65536 // number)))
    store(costs, place, total)


@kernel(allocates=True)
def mean_over_rows(costs, arms, first, last):
    """Replace each cost by the mean over the row arms of its pixel, in some rows."""
    columns, labels = costs.shape[1:]
    flat, row_sums = costs.reshape(-1), np.zeros((columns + 1) * labels, np.uint16)
    for row in range(first, last):
        begin = row * columns * labels
        for place in range(0, columns * labels, LANES):
            store(row_sums, place + labels, add(load(row_sums, place),
                                                load(flat, begin + place)))
        for column in range(columns):
            low = column - np.int64(arms[row, column, LEFT])
            high = column + np.int64(arms[row, column, RIGHT]) + 1
            for block in range(0, labels, LANES):
                total = subtract(load(row_sums, high * labels + block),
                                 load(row_sums, low * labels + block))
                _store_mean(total, high - low, flat, begin + column * labels + block)


@kernel(allocates=True)
def mean_over_columns(costs, arms, longest, first, last):
    """Replace each cost by the mean over the column arms, up to the longest, in some columns."""
    rows, columns, labels = costs.shape
    flat, span, stride = costs.reshape(-1), 2 * longest + 2, (last - first) * labels
    ring = np.zeros(span * stride, np.uint16)
    for newest in range(rows + longest):
        if newest < rows:
            above, here = newest % span * stride, (newest + 1) % span * stride
            begin = (newest * columns + first) * labels
            for place in range(0, (last - first) * labels, LANES):
                store(ring, here + place, add(load(ring, above + place),
                                              load(flat, begin + place)))
        row = newest - longest
        if row < 0:
            continue
        for column in range(first, last):
            up, down = np.int64(arms[row, column, UP]), np.int64(arms[row, column, DOWN])
            low = (row - up) % span * stride + (column - first) * labels
            high = (row + down + 1) % span * stride + (column - first) * labels
            for block in range(0, labels, LANES):
                total = subtract(load(ring, high + block), load(ring, low + block))
                _store_mean(total, up + down + 1, flat, (row * columns + column) * labels + block)
