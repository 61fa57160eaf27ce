# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The cost of every candidate of a row: how little possible a match is, 0 = fully possible.

cost = min(hamming(census), census_cut) + min(|slope difference|, slope_cut) + what the priors add
"""
from typing import NamedTuple

from numba import njit
import numpy as np

from fuzzy_stereo_ros.matching.kernels.simd import (
    add, bit_or, bit_xor, count_bits, count_bits_of_word, lane_numbers, LANES, load, minimum,
    saturating_subtract, shift_right, splat, store, subtract)

PRIOR_REACH = 64     # a prior's table is constant beyond this distance in labels


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
    """A map that costs may lean on: weight 0 at a pixel means that it does not."""

    labels: np.ndarray            # uint16 (R, C)
    weights: np.ndarray           # uint8 (R, C), row of the table
    table: np.ndarray             # uint8 (W * 4 * PRIOR_REACH,), cost by label - prior's label


@njit(nogil=True, cache=True)
def _raw(features, row, column, label, census_0, census_1, census_2, slope, cuts):
    stride, columns = features.target_stride, features.columns
    candidate = row * 3 * stride + columns - 1 - column + label
    target = features.target_census
    distance = add(add(
        count_bits(bit_xor(census_0, load(target, candidate))),
        count_bits(bit_xor(census_1, load(target, candidate + stride)))),
        count_bits(bit_xor(census_2, load(target, candidate + 2 * stride))))
    other = load(features.target_slopes, row * stride + columns - 1 - column + label)
    difference = bit_or(saturating_subtract(slope, other), saturating_subtract(other, slope))
    return add(minimum(distance, cuts[0]), minimum(difference, cuts[1]))


@njit(nogil=True, cache=True)
def _prior_at(prior, row, column, label):
    """Return what a prior adds to the labels from `label` on at a pixel."""
    distance = label - np.int64(prior.labels[row, column])
    distance = min(max(distance, -PRIOR_REACH), PRIOR_REACH - LANES)
    start = np.int64(prior.weights[row, column]) * 4 * PRIOR_REACH + 2 * PRIOR_REACH + distance
    return load(prior.table, start)


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
    cuts = (splat(np.uint8(features.census_cut)), splat(np.uint8(features.slope_cut)))
    stride = features.census_stride
    for column in range(begin, end):
        base = row * 3 * stride + column
        census_0 = splat(features.census[base])
        census_1 = splat(features.census[base + stride])
        census_2 = splat(features.census[base + 2 * stride])
        slope = splat(features.slopes[row, column])
        leans_half = half_prior.weights[row, column] > 0
        leans_previous = previous_prior.weights[row, column] > 0
        for block in range(blocks):
            label = low + LANES * block
            cost = _raw(features, row, column, label, census_0, census_1, census_2, slope, cuts)
            if leans_half:
                cost = add(cost, _prior_at(half_prior, row, column, label))
            if leans_previous:
                cost = add(cost, _prior_at(previous_prior, row, column, label))
            store(costs, at, bit_or(cost, _beyond(label, features.disparities)))
            at += LANES


@njit(nogil=True, cache=True)
def raw_row(features, row, blocks, costs, at):
    """Write the costs of a whole row, every label, without priors and without a mask."""
    cuts = (splat(np.uint8(features.census_cut)), splat(np.uint8(features.slope_cut)))
    stride = features.census_stride
    for column in range(features.columns):
        base = row * 3 * stride + column
        census_0 = splat(features.census[base])
        census_1 = splat(features.census[base + stride])
        census_2 = splat(features.census[base + 2 * stride])
        slope = splat(features.slopes[row, column])
        for block in range(blocks):
            store(costs, at, _raw(features, row, column, LANES * block,
                                  census_0, census_1, census_2, slope, cuts))
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
