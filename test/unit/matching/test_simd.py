# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Each vector operation, and each way to reach single numbers, against NumPy."""
from fuzzy_stereo_ros.matching.kernels import addresses, simd
from fuzzy_stereo_ros.matching.kernels.simd import LANES, load, store
from numba import njit
import numpy as np
import pytest

KINDS = [np.uint8, np.uint16]
VECTORS = 200


def full(which):
    """Return the masks that comparisons give: all bits where true."""
    return lambda a, b: np.where(which(a, b), np.iinfo(a.dtype).max, 0)


def cut(wide):
    """Return an operation of two vectors done in int64 and cut to the range of their type."""
    return lambda a, b: np.clip(wide(a.astype(np.int64), b.astype(np.int64)),
                                0, np.iinfo(a.dtype).max)


# In the order in which `pairwise` writes them.
EXPECTED = {
    'minimum': np.minimum,
    'maximum': np.maximum,
    'saturating_add': cut(np.add),
    'saturating_subtract': cut(np.subtract),
    'add': np.add,
    'subtract': np.subtract,
    'bit_and': np.bitwise_and,
    'bit_or': np.bitwise_or,
    'bit_xor': np.bitwise_xor,
    'equal': full(np.equal),
    'at_most': full(np.less_equal),
    'less': full(np.less),
    'label_below': lambda a, b: np.concatenate([a[-1:], b[:-1]]),
    'label_above': lambda a, b: np.concatenate([a[1:], b[:1]]),
    'choose': lambda a, b: np.where(a != 0, b, a ^ b),
    'reversed_lanes': lambda a, b: a[::-1],
    'multiply': np.multiply,
}


@njit
def pairwise(a, b, out):
    one, two = load(a, 0), load(b, 0)
    store(out, 0 * LANES, simd.minimum(one, two))
    store(out, 1 * LANES, simd.maximum(one, two))
    store(out, 2 * LANES, simd.saturating_add(one, two))
    store(out, 3 * LANES, simd.saturating_subtract(one, two))
    store(out, 4 * LANES, simd.add(one, two))
    store(out, 5 * LANES, simd.subtract(one, two))
    store(out, 6 * LANES, simd.bit_and(one, two))
    store(out, 7 * LANES, simd.bit_or(one, two))
    store(out, 8 * LANES, simd.bit_xor(one, two))
    store(out, 9 * LANES, simd.equal(one, two))
    store(out, 10 * LANES, simd.at_most(one, two))
    store(out, 11 * LANES, simd.less(one, two))
    store(out, 12 * LANES, simd.label_below(one, two))
    store(out, 13 * LANES, simd.label_above(one, two))
    store(out, 14 * LANES, simd.choose(one, two, simd.bit_xor(one, two)))
    store(out, 15 * LANES, simd.reversed_lanes(one, two))
    store(out, 16 * LANES, simd.multiply(one, two))
    return simd.equal_bits(one, two)


@njit
def of_one_and_a_number(a, scalar, number, out):
    one = load(a, 0)
    store(out, 0, simd.splat(scalar))
    store(out, LANES, simd.splat_like(one, number))
    store(out, 2 * LANES, simd.shift_right(one, number & 7))
    store(out, 3 * LANES, simd.shift_left(one, number & 7))


@njit
def counted(a, out):
    one = load(a, 0)
    store(out, 0, simd.count_bits(one))
    return simd.lowest(one)


@njit
def high_product(a, b, out):
    store(out, 0, simd.high_product(load(a, 0), load(b, 0)))


@njit
def narrowed(a, out):
    store(out, 0, simd.narrow(load(a, 0)))


@njit
def copied(source, at, target, to):
    store(target, to, load(source, at))


def vectors(kind, seed):
    """Return pairs of vectors: numbers of the whole range, many of them small, large or equal."""
    random = np.random.default_rng(seed)
    top = np.iinfo(kind).max
    for _ in range(VECTORS):
        one, two = random.integers(0, top + 1, (2, LANES))
        edges = random.choice([0, 1, 2, top // 2, top // 2 + 1, top - 1, top], (2, LANES))
        one, two = (np.where(random.random(LANES) < 0.4, edge, vector)
                    for edge, vector in zip(edges, (one, two)))
        two = np.where(random.random(LANES) < 0.2, one, two)
        yield one.astype(kind), two.astype(kind)


@pytest.mark.parametrize('name', EXPECTED)
@pytest.mark.parametrize('kind', KINDS)
def test_an_operation_of_two_vectors_is_that_of_numpy(kind, name):
    at = list(EXPECTED).index(name) * LANES
    out = np.zeros(len(EXPECTED) * LANES, kind)
    for one, two in vectors(kind, at):
        pairwise(one, two, out)
        np.testing.assert_array_equal(out[at:at + LANES], EXPECTED[name](one, two))


@pytest.mark.parametrize('kind', KINDS)
def test_the_bits_of_equal_lanes_are_set(kind):
    out = np.zeros(len(EXPECTED) * LANES, kind)
    for one, two in vectors(kind, 1):
        bits = int(pairwise(one, two, out))
        assert [bits >> lane & 1 for lane in range(LANES)] == (one == two).tolist()


@pytest.mark.parametrize('kind', KINDS)
def test_a_number_goes_to_every_lane_and_is_cut_to_the_lanes_bits(kind):
    out = np.zeros(4 * LANES, kind)
    top = np.iinfo(kind).max
    for (one, two), number in zip(vectors(kind, 2), [0, 1, top, top + 1, -1, 7, *range(190)]):
        of_one_and_a_number(one, two[0], number, out)
        assert np.all(out[:LANES] == two[0])
        assert np.all(out[LANES:2 * LANES] == number % (top + 1))
        np.testing.assert_array_equal(out[2 * LANES:3 * LANES], one >> kind(number & 7))
        np.testing.assert_array_equal(out[3 * LANES:], one << kind(number & 7))


@pytest.mark.parametrize('kind', KINDS)
def test_bits_are_counted_and_the_lowest_is_found(kind):
    out = np.zeros(LANES, kind)
    for one, _ in vectors(kind, 3):
        assert counted(one, out) == one.min()
        assert out.tolist() == [int(value).bit_count() for value in one]


def test_of_a_product_the_upper_sixteen_bits_can_be_had():
    out = np.zeros(LANES, np.uint16)
    for one, two in vectors(np.uint16, 6):
        high_product(one, two, out)
        np.testing.assert_array_equal(out, one.astype(np.int64) * two >> 16)


def test_narrow_keeps_the_low_eight_bits():
    out = np.zeros(LANES, np.uint8)
    for one, _ in vectors(np.uint16, 4):
        narrowed(one, out)
        np.testing.assert_array_equal(out, one % 256)


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
