# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The cost of every match as 1 - the product of memberships of four differences.

Not in the paper, whose three grey classes do not tell pixels apart. The differences are those of
the census (Zabih and Woodfill, 1994), of colour and of its slope, both insensitive to sampling
(Birchfield and Tomasi, 1998), and of the Sobel gradient; the product of exponential memberships
is the membership of their weighted sum.
"""
from typing import NamedTuple

from fuzzy_stereo_ros.matching.kernels.compiled import kernel
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


@kernel
def census(fine, radius, first_bit, codes, first, last):
    """
    Compare the neighbours in a square with the centre: a bit each, set where darker.

    fine: float32 (R + 2 * radius, C + 2 * radius), borders repeated; codes: uint16 (R, K, C), a
    plane for 16 bits; first_bit: of all the bits of a pixel, the first to be written
    """
    columns = codes.shape[2]
    for row in range(first, last):
        bit = first_bit
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


class PixelFeatures(NamedTuple):
    """What is compared of each pixel; of the target mirrored, the last column repeated."""

    codes: np.ndarray    # uint16 (R, K, C or C + labels), census
    planes: np.ndarray   # uint16 (R, PLANES, C or C + labels)


@kernel
def fill_costs(reference, target, scales, weights, disparities, first_inside, costs, first, last):
    """
    Write the costs of all matches of some rows.

    A label that points beyond the target image costs as much as the last one inside, at least half
    of FULL: a flat neutral cost there would attract low texture such as roads.

    reference, target: the fields of PixelFeatures; scales: how many of the K count; weights:
    uint16 (4,) of a bit, a step of colour, of slope, of gradient, in UNITs; first_inside: first
    column of the target that exists; costs: uint16 (R, C, labels), FULL for labels from
    `disparities` on.
    """
    (codes, planes), (target_codes, target_planes) = reference, target
    columns, labels = costs.shape[1], costs.shape[2]
    flat, flat_planes, flat_codes = (costs.reshape(-1), target_planes.reshape(-1),
                                     target_codes.reshape(-1))
    stride = target_planes.shape[2]
    bit, colour, slope, gradient = (splat(weights[0]), splat(weights[1]), splat(weights[2]),
                                    splat(weights[3]))
    for row in range(first, last):
        here, code = planes[row], codes[row]
        for column in range(columns):
            place = (row * columns + column) * labels
            for block in range(0, labels, LANES):
                begin = columns - 1 - column + block
                distance = splat(np.uint16(0))
                for scale in range(scales):
                    other = load(flat_codes, (row * codes.shape[1] + scale) * stride + begin)
                    distance = add(distance, count_bits(bit_xor(splat(code[scale, column]),
                                                                other)))
                exponent = multiply(distance, bit)
                begin += row * PLANES * stride
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
