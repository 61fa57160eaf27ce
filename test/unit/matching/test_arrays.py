# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Memory that a matcher keeps, cut from blocks, and how vectors reach it."""
import gc
from weakref import ref

from fuzzy_stereo_ros.matching.arrays import BLOCK, LINE, OWN, SMALL, zeros
from fuzzy_stereo_ros.matching.kernels import addresses
from fuzzy_stereo_ros.matching.kernels.simd import LANES, load, store
from numba import njit
import numpy as np
import pytest


def test_arrays_share_no_byte_and_begin_at_lines_but_not_at_one_place_of_a_page():
    arrays = [zeros(SMALL + extra, np.uint8) for extra in (0, 1, 0, LINE, 0)]
    for number, array in enumerate(arrays):
        array[:] = number
    assert all((array == number).all() for number, array in enumerate(arrays))
    places = [array.ctypes.data for array in arrays]
    assert not any(place % LINE for place in (*places, zeros(OWN, np.uint8).ctypes.data))
    assert len({place % 4096 for place in places}) == len(places)


def test_a_block_ends_with_the_last_of_its_arrays():
    arrays = [zeros(OWN - 1, np.uint8) for _ in range(BLOCK // OWN + 1)]
    block = ref(arrays[-1].base)
    del arrays
    gc.collect()
    assert block() is None


# ---- vectors in memory ----


KINDS = [np.uint8, np.uint16]


@njit
def copied(source, at, target, to):
    store(target, to, load(source, at))


def test_an_array_with_gaps_has_no_address_to_walk_from():
    rows = np.zeros((4, 6), np.uint8)
    assert addresses.address_of(rows[1:]) == rows.ctypes.data + 6
    with pytest.raises(ValueError, match=r'strides \(6, 2\) is not contiguous'):
        addresses.address_of(rows[:, ::2])


@pytest.mark.parametrize('kind, place', [
    *((kind, lambda array: array) for kind in KINDS), (np.uint8, lambda array: array.ctypes.data)],
    ids=['uint8', 'uint16', 'addresses'])
def test_loads_and_stores_need_no_alignment_and_touch_no_other_element(kind, place):
    source = np.arange(3 * LANES, dtype=kind)
    for at in range(2 * LANES + 1):
        target = np.full(3 * LANES, 255, kind)
        copied(place(source), at, place(target), 2 * LANES - at)
        expected = np.full(3 * LANES, 255, kind)
        expected[2 * LANES - at:3 * LANES - at] = source[at:at + LANES]
        np.testing.assert_array_equal(target, expected)
