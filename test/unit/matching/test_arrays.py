# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Memory that a matcher keeps, cut from blocks, and its addresses."""
import gc
from weakref import ref

from fuzzy_stereo_ros.matching.arrays import BLOCK, LINE, OWN, SMALL, zeros
from fuzzy_stereo_ros.matching.kernels import addresses
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


def test_an_array_with_gaps_has_no_address_to_walk_from():
    rows = np.zeros((4, 6), np.uint8)
    assert addresses.address_of(rows[1:]) == rows.ctypes.data + 6
    with pytest.raises(ValueError, match=r'strides \(6, 2\) is not contiguous'):
        addresses.address_of(rows[:, ::2])
