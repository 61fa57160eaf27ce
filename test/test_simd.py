# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Each vector operation against NumPy, lane by lane."""
from fuzzy_stereo_ros.matching.kernels import simd
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
    return simd.equal_bits(one, two)


@njit
def of_one_and_a_number(a, scalar, number, out):
    one = load(a, 0)
    store(out, 0, simd.splat(scalar))
    store(out, LANES, simd.splat_like(one, number))
    store(out, 2 * LANES, simd.shift_right(one, number & 7))
    store(out, 3 * LANES, simd.shift_left(one, number & 7))


@njit
def of_bytes(a, out):
    one = load(a, 0)
    store(out, 0, simd.count_bits(one))
    store(out, LANES, simd.lane_numbers())
    return simd.lowest(one)


@njit
def narrowed(a, out):
    store(out, 0, simd.narrow(load(a, 0)))


@njit
def of_word(word):
    return simd.first_set(word), simd.count_bits_of_word(word)


@njit
def split_colours(pixels, at, out):
    blue, green, red = simd.load_colours(pixels, at)
    store(out, 0, blue)
    store(out, LANES, green)
    store(out, 2 * LANES, red)


@njit
def peeked(array, at):
    return simd.peek(array, at)


@njit
def copied(source, at, target, to):
    store(target, to, load(source, at))


def vectors(kind, seed):
    """Return pairs of vectors: numbers of the whole range, many of them small, large or equal."""
    chance = np.random.default_rng(seed)
    top = np.iinfo(kind).max
    for _ in range(VECTORS):
        one, two = chance.integers(0, top + 1, (2, LANES))
        edges = chance.choice([0, 1, 2, top // 2, top // 2 + 1, top - 1, top], (2, LANES))
        one, two = (np.where(chance.random(LANES) < 0.4, edge, vector)
                    for edge, vector in zip(edges, (one, two)))
        two = np.where(chance.random(LANES) < 0.2, one, two)
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


def test_bits_are_counted_lanes_numbered_and_the_lowest_found():
    out = np.zeros(2 * LANES, np.uint8)
    for one, _ in vectors(np.uint8, 3):
        assert of_bytes(one, out) == one.min()
        assert out[:LANES].tolist() == [int(value).bit_count() for value in one]
        assert out[LANES:].tolist() == list(range(LANES))


def test_narrow_keeps_the_low_eight_bits():
    out = np.zeros(LANES, np.uint8)
    for one, _ in vectors(np.uint16, 4):
        narrowed(one, out)
        np.testing.assert_array_equal(out, one % 256)


@pytest.mark.parametrize('at', [0, 1, 7])
def test_pixels_of_three_bytes_are_split_into_their_colours(at):
    pixels = np.random.default_rng(5).integers(0, 256, at + 3 * LANES).astype(np.uint8)
    out = np.zeros(3 * LANES, np.uint16)
    split_colours(pixels, at, out)
    np.testing.assert_array_equal(out.reshape(3, LANES), pixels[at:].reshape(LANES, 3).T)


@pytest.mark.parametrize('kind', KINDS)
def test_a_peek_reads_one_element(kind):
    array = np.arange(250, 256, dtype=kind)
    assert [peeked(array, at) for at in range(6)] == list(range(250, 256))


@pytest.mark.parametrize('word', [
    0, 1, 2, 0x80000000, 0xFFFFFFFF, 0x00F0F000, *(3 << place for place in range(31))])
def test_the_first_set_bit_of_a_word_is_found_and_its_bits_are_counted(word):
    first = (word & -word).bit_length() - 1 if word else 32
    assert of_word(np.uint32(word)) == (first, word.bit_count())


@pytest.mark.parametrize('kind', KINDS)
def test_loads_and_stores_need_no_alignment_and_touch_no_other_element(kind):
    source = np.arange(3 * LANES, dtype=kind)
    for at in range(2 * LANES + 1):
        target = np.full(3 * LANES, 255, kind)
        copied(source, at, target, 2 * LANES - at)
        expected = np.full(3 * LANES, 255, kind)
        expected[2 * LANES - at:3 * LANES - at] = source[at:at + LANES]
        np.testing.assert_array_equal(target, expected)
