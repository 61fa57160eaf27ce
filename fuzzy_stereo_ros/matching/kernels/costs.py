# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The cost of every candidate of a row: how little possible a match is, 0 = fully possible.

cost = min(hamming(census), census_cut) + min(|slope difference|, slope_cut) + what the priors add
"""
from typing import NamedTuple

from fuzzy_stereo_ros.matching.kernels.simd import (
    add, bit_or, bit_xor, count_bits, count_bits_of_word, lane_numbers, LANES, load, minimum,
    saturating_subtract, shift_right, splat, store, subtract)
from numba import njit
import numpy as np


class Features(NamedTuple):
    """What costs are made of; see features.py. The target's arrays are mirrored."""

    columns: int
    disparities: int
    census_cut: int
    slope_cut: int
    census: np.ndarray            # uint8 (R * 3 * census_stride,)
    slopes: np.ndarray            # uint8 (R, stride)
    target_census: np.ndarray     # uint8 (R * 3 * target_stride,)
    target_slopes: np.ndarray     # uint8 (R * target_stride,)
    census_stride: int
    target_stride: int


class Prior(NamedTuple):
    """
    A map that costs may lean on: weight 0 at a pixel means that it does not.

    The table has a row a weight: what is added by label - prior's label, 0 at index `reach`.
    """

    labels: np.ndarray            # uint16 (R, C)
    weights: np.ndarray           # uint8 (R, C), row of the table
    table: np.ndarray             # uint8 (weights * 2 * reach,)
    reach: int                    # more labels than there are


@njit(inline='always')
def _raw(target, candidate, stride, target_slopes, slope_at, code, slope, cuts):
    """Return the costs of LANES candidates of a pixel: census distance and gradient."""
    distance = add(add(
        count_bits(bit_xor(code[0], load(target, candidate))),
        count_bits(bit_xor(code[1], load(target, candidate + stride)))),
        count_bits(bit_xor(code[2], load(target, candidate + 2 * stride))))
    other = load(target_slopes, slope_at)
    difference = bit_or(saturating_subtract(slope, other), saturating_subtract(other, slope))
    return add(minimum(distance, cuts[0]), minimum(difference, cuts[1]))


@njit(nogil=True, cache=True)
def _beyond(label, disparities):
    """255 in the lanes of the labels that do not exist."""
    inside = max(min(disparities - label, LANES), 0)
    if inside == LANES:
        return splat(np.uint8(0))
    # lane >= inside: max(lane, inside) - lane is 0 there; saturate what is left to 255.
    lanes = lane_numbers()
    short = saturating_subtract(splat(np.uint8(inside)), lanes)
    return subtract(minimum(short, splat(np.uint8(1))), splat(np.uint8(1)))


@njit(nogil=True, cache=True)
def cost_row(features, half_prior, previous_prior, row, begin, end, low, blocks, costs, at):
    """
    Write the costs of one row of a tile: labels low .. low + 32 * blocks of columns begin .. end.

    costs: uint8, written from index `at`, 32 * blocks a pixel; 255 where a label does not exist.
    """
    cuts = splat(np.uint8(features.census_cut)), splat(np.uint8(features.slope_cut))
    target, target_slopes = features.target_census, features.target_slopes
    target_stride = features.target_stride
    base = row * 3 * features.census_stride
    first, last = base + begin, base + end
    codes_0 = features.census[first:last]
    codes_1 = features.census[first + features.census_stride:last + features.census_stride]
    codes_2 = features.census[first + 2 * features.census_stride:]
    slopes = features.slopes[row, begin:end]
    half_labels, half_weights = (half_prior.labels[row, begin:end],
                                 half_prior.weights[row, begin:end])
    labels, weights = previous_prior.labels[row, begin:end], previous_prior.weights[row, begin:end]
    half_table, half_reach = half_prior.table, half_prior.reach
    table, reach = previous_prior.table, previous_prior.reach
    exist = low + LANES * blocks <= features.disparities
    pointed = features.columns - 1 - begin + low
    candidate, slope_at = row * 3 * target_stride + pointed, row * target_stride + pointed
    for index in range(end - begin):
        code = splat(codes_0[index]), splat(codes_1[index]), splat(codes_2[index])
        slope = splat(slopes[index])
        half_at = (2 * np.int64(half_weights[index]) + 1) * half_reach - half_labels[index] + low
        prior_at = (2 * np.int64(weights[index]) + 1) * reach - labels[index] + low
        for block in range(blocks):
            offset = LANES * block
            cost = _raw(target, candidate - index + offset, target_stride,
                        target_slopes, slope_at - index + offset, code, slope, cuts)
            cost = add(cost, add(load(half_table, half_at + offset),
                                 load(table, prior_at + offset)))
            if not exist:
                cost = bit_or(cost, _beyond(low + offset, features.disparities))
            store(costs, at, cost)
            at += LANES


@njit(nogil=True, cache=True)
def raw_row(features, row, blocks, costs, at):
    """Write the costs of a whole row, every label, without priors and without a mask."""
    cuts = splat(np.uint8(features.census_cut)), splat(np.uint8(features.slope_cut))
    stride, target_stride = features.census_stride, features.target_stride
    census, slopes = features.census, features.slopes[row]
    target, target_slopes = features.target_census, features.target_slopes
    for column in range(features.columns):
        base = row * 3 * stride + column
        code = (splat(census[base]), splat(census[base + stride]),
                splat(census[base + 2 * stride]))
        pointed = features.columns - 1 - column
        for block in range(blocks):
            label = LANES * block
            store(costs, at, _raw(
                target, row * 3 * target_stride + pointed + label, target_stride, target_slopes,
                row * target_stride + pointed + label, code, splat(slopes[column]), cuts))
            at += LANES


@njit(nogil=True, cache=True)
def box_row(above, here, below, features, blocks, places, costs, at):
    """Write the sums of raw costs over 3 x 3 pixels / 2**places, borders repeated."""
    columns, size = features.columns, LANES * blocks
    for block in range(blocks):
        mask = _beyond(LANES * block, features.disparities)
        offset = LANES * block
        middle = add(load(here, offset), add(load(above, offset), load(below, offset)))
        left = middle
        for column in range(columns):
            next_one = min(column + 1, columns - 1) * size + offset
            right = add(load(here, next_one), add(load(above, next_one), load(below, next_one)))
            total = shift_right(add(left, add(middle, right)), places)
            store(costs, at + column * size + offset, bit_or(total, mask))
            left, middle = middle, right


@njit(nogil=True, cache=True)
def layout_of(features):
    """Return the whole numbers that match_cost needs."""
    return (features.columns, features.census_stride, features.target_stride,
            features.census_cut, features.slope_cut)


@njit(inline='always')
def match_cost(census, target_census, slopes, target_slopes, layout, row, column, label):
    """
    Return the cost of one candidate without priors, as cost_row has it.

    The arrays are those of the features, unpacked by the caller outside of its loop: unpacking
    an array counts references, which is slow.
    """
    columns, stride, target_stride, census_cut, slope_cut = layout
    mirrored = columns - 1 - column + label
    base, candidate = row * 3 * stride + column, row * 3 * target_stride + mirrored
    word = np.uint32(0)
    for plane in range(3):
        code = census[base + plane * stride] ^ target_census[candidate + plane * target_stride]
        word |= np.uint32(code) << np.uint32(8 * plane)
    difference = abs(np.int64(slopes[row, column])
                     - np.int64(target_slopes[row * target_stride + mirrored]))
    return min(count_bits_of_word(word), census_cut) + min(difference, slope_cut)
