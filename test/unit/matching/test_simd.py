# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Each vector operation, and each way to reach single numbers, against NumPy."""
from fuzzy_stereo_ros.matching.kernels import addresses, simd
from fuzzy_stereo_ros.matching.kernels.possibility.features import load_colours
from fuzzy_stereo_ros.matching.kernels.scanlines import winner_takes_all
from fuzzy_stereo_ros.matching.kernels.simd import FLOATS, LANES, load, store
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
def numbered(out):
    store(out, 0, simd.lane_numbers(load(out, 0)))


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
def of_word(word):
    return simd.first_set(word), simd.count_bits_of_word(word)


@njit
def split_colours(pixels, at, out):
    blue, green, red = load_colours(pixels, at)
    store(out, 0, blue)
    store(out, LANES, green)
    store(out, 2 * LANES, red)


@njit
def splatted_word(words, at, out):
    store(out, 0, addresses.splat_word(load(out, 0), words, at))


@njit
def lowest_of_four(vectors, at, out, four, four_at):
    packed = winner_takes_all.lowest_of_four(
        load(vectors, at), load(vectors, at + LANES), load(vectors, at + 2 * LANES),
        load(vectors, at + 3 * LANES))
    first, second, third, fourth = winner_takes_all.unpacked(load(out, 0), packed)
    store(out, 0, first)
    store(out, LANES, second)
    store(out, 2 * LANES, third)
    store(out, 3 * LANES, fourth)
    winner_takes_all.store_four(four, four_at, packed)


@njit
def peeked(memory, at):
    return addresses.load_byte(memory, at)


@njit
def poked(memory, at, number):
    addresses.store_byte(memory, at, number)


@njit
def peeked_at(address, at):
    return (addresses.load_short(address, at), addresses.load_word(address, at),
            addresses.load_long(address, at))


@njit
def poked_short(address, at, number):
    addresses.store_short(address, at, number)


@njit
def poked_word(address, at, number):
    addresses.store_word(address, at, number)


@njit
def weighted_bytes(numbers, at, weights, scale, out, to):
    total = simd.no_floats()
    for index in range(weights.size):
        total = simd.add_weighted(total, numbers, at + index, weights[index])
    simd.store_rounded(out, to, total, scale)


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


@pytest.mark.parametrize('kind', KINDS)
def test_bits_are_counted_and_the_lowest_is_found(kind):
    out = np.zeros(LANES, kind)
    for one, _ in vectors(kind, 3):
        assert counted(one, out) == one.min()
        assert out.tolist() == [int(value).bit_count() for value in one]


def test_lanes_are_numbered():
    out = np.zeros(LANES, np.uint8)
    numbered(out)
    assert out.tolist() == list(range(LANES))


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


@pytest.mark.parametrize('at', [0, 1, 7])
def test_bytes_are_weighted_added_and_rounded_as_float32_is(at):
    chance = np.random.default_rng(8)
    for _ in range(50):
        numbers = chance.integers(0, 256, at + 5 + FLOATS).astype(np.uint8)
        weights = chance.random(5).astype(np.float32)
        scale, out = np.float32(1) / weights.sum(), np.full(FLOATS + 9, 99, np.uint8)
        weighted_bytes(numbers, at, weights, scale, out, at)
        total = np.zeros(FLOATS, np.float32)
        for index, weight in enumerate(weights):
            total += weight * numbers[at + index:at + index + FLOATS].astype(np.float32)
        rounded = (total * scale + np.float32(0.5)).astype(np.uint8)
        np.testing.assert_array_equal(out[at:at + FLOATS], rounded)
        assert out[:at].tolist() + out[at + FLOATS:].tolist() == [99] * 9


@pytest.mark.parametrize('at', [0, 1, 7])
def test_pixels_of_three_bytes_are_split_into_their_colours(at):
    pixels = np.random.default_rng(5).integers(0, 256, at + 3 * LANES).astype(np.uint8)
    out = np.zeros(3 * LANES, np.uint16)
    split_colours(pixels, at, out)
    np.testing.assert_array_equal(out.reshape(3, LANES), pixels[at:].reshape(LANES, 3).T)


def test_the_byte_that_a_word_repeats_goes_to_every_lane():
    words, out = np.arange(256, dtype=np.uint32) * 0x01010101, np.zeros(LANES + 1, np.uint8)
    for at in range(256):
        splatted_word(words.ctypes.data, at, out)
        assert out.tolist() == [at] * LANES + [0]


@pytest.mark.parametrize('at', [0, 3])
def test_the_lowest_of_four_vectors_are_packed_unpacked_and_stored(at):
    out, four = np.zeros(4 * LANES, np.uint8), np.full(12, 99, np.uint8)
    pairs = list(vectors(np.uint8, 6))
    for (first, second), (third, fourth) in zip(pairs, pairs[1:]):
        given = np.concatenate([np.zeros(at, np.uint8), first, second, third, fourth])
        lowest = [vector.min() for vector in (first, second, third, fourth)]
        for target in (four, four.ctypes.data):
            four[:] = 99
            lowest_of_four(given, at, out, target, 5)
            assert four.tolist() == [99] * 5 + lowest + [99] * 3
        np.testing.assert_array_equal(out, np.repeat(lowest, LANES))


@pytest.mark.parametrize('lane', range(LANES))
@pytest.mark.parametrize('which', range(4))
def test_the_lowest_of_four_vectors_is_found_in_any_lane(which, lane):
    given, four = np.full((4, LANES), 200, np.uint8), np.zeros(4, np.uint8)
    given[which, lane] = 7
    lowest_of_four(given.reshape(-1), 0, np.zeros(4 * LANES, np.uint8), four, 0)
    assert four.tolist() == [7 if vector == which else 200 for vector in range(4)]


@pytest.mark.parametrize('kind', [*KINDS, np.uint32])
def test_a_peek_reads_one_element_and_a_poke_writes_it_cut_to_its_bits(kind):
    array = np.arange(250, 256, dtype=kind)
    assert [peeked(array, at) for at in range(6)] == list(range(250, 256))
    poked(array, 2, np.int64(-1))
    poked(array, 4, np.uint8(9))
    assert array.tolist() == [250, 251, np.iinfo(kind).max, 253, 9, 255]


def test_an_array_with_gaps_has_no_address_to_walk_from():
    rows = np.zeros((4, 6), np.uint8)
    assert addresses.address_of(rows[1:]) == rows.ctypes.data + 6
    with pytest.raises(ValueError, match=r'strides \(6, 2\) is not contiguous'):
        addresses.address_of(rows[:, ::2])


def test_single_numbers_are_read_and_written_at_addresses():
    numbers = np.random.default_rng(7).integers(-2**63, 2**63, 9)
    address = numbers.ctypes.data
    for at in range(9):
        assert peeked(address, at) == numbers.view(np.uint8)[at]
        assert peeked_at(address, at) == (
            numbers.view(np.uint16)[at], numbers.view(np.int32)[at], numbers[at])
    poked_to = ((poked, np.uint8), (poked_short, np.uint16), (poked_word, np.uint32))
    for store_byte, kind in poked_to:
        for value in (0, 77, 2**40 + 5, -3):
            expected = numbers.view(kind).copy()
            expected[6] = value % (np.iinfo(kind).max + 1)
            store_byte(address, 6, value)
            np.testing.assert_array_equal(numbers.view(kind), expected)
    assert peeked(address + 3, -2) == numbers.view(np.uint8)[1]


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


@pytest.mark.parametrize('at', [0, 5, LANES])
def test_bytes_are_loaded_from_addresses_and_stored_to_them(at):
    source, target = np.arange(2 * LANES, dtype=np.uint8), np.full(3 * LANES, 255, np.uint8)
    copied(source.ctypes.data, at, target.ctypes.data, at + 1)
    expected = np.full(3 * LANES, 255, np.uint8)
    expected[at + 1:at + 1 + LANES] = source[at:at + LANES]
    np.testing.assert_array_equal(target, expected)


# ---- two blocks in one value ----


@njit
def of_two_blocks(one, two, words, out):
    """Write what the intrinsics make of vectors of 64 lanes, and return the scalars."""
    kind, lanes = simd.splat_wide(np.uint8(7)), 2 * LANES
    a, b = simd.load_like(kind, one, 0), simd.load_like(kind, two, 0)
    for index, vector in enumerate((
            kind, simd.minimum(a, b), simd.saturating_add(a, b), simd.saturating_subtract(a, b),
            simd.label_below(a, b), simd.label_above(a, b), simd.count_bits(a),
            simd.lane_numbers(a), simd.splat_like(a, 259), addresses.splat_word(a, words, 1))):
        store(out, index * lanes, vector)
    return simd.equal_bits(a, b), simd.lowest(a), simd.lanes_of(a)


@njit
def lowest_of_four_wide(vectors, out, four):
    kind, lanes = simd.splat_wide(np.uint8(0)), 2 * LANES
    packed = winner_takes_all.lowest_of_four(
        simd.load_like(kind, vectors, 0), simd.load_like(kind, vectors, lanes),
        simd.load_like(kind, vectors, 2 * lanes), simd.load_like(kind, vectors, 3 * lanes))
    for index, vector in enumerate(winner_takes_all.unpacked(kind, packed)):
        store(out, index * lanes, vector)
    winner_takes_all.store_four(four, 0, packed)


@pytest.mark.parametrize('seed', range(5))
def test_two_blocks_are_treated_like_one_of_twice_the_lanes(seed):
    chance, lanes = np.random.default_rng(seed), 2 * LANES
    one, two = chance.integers(0, 256, (2, lanes)).astype(np.uint8)
    two[chance.integers(0, lanes, 9)] = one[0]
    words = np.array([1, 2, 3], np.uint32) * 0x01010101
    words = words.astype(np.uint32)
    out = np.zeros(10 * lanes, np.uint8)
    bits, least, number = of_two_blocks(one, two, words.ctypes.data, out)
    expected = [
        np.full(lanes, 7), np.minimum(one, two), cut(np.add)(one, two),
        cut(np.subtract)(one, two), EXPECTED['label_below'](one, two),
        EXPECTED['label_above'](one, two), np.unpackbits(one[:, None], axis=1).sum(axis=1),
        np.arange(lanes), np.full(lanes, 3), np.full(lanes, 2)]
    np.testing.assert_array_equal(out.reshape(10, lanes), expected)
    assert int(bits) == sum(1 << lane for lane in range(lanes) if one[lane] == two[lane])
    assert (least, number) == (one.min(), lanes)
    assert of_word_64(np.uint64(1) << np.uint64(40 + seed)) == 40 + seed


@njit
def of_word_64(word):
    return simd.first_set(word)


@pytest.mark.parametrize('seed', range(5))
def test_the_lowest_of_four_vectors_of_two_blocks(seed):
    vectors = np.random.default_rng(seed).integers(0, 256, (4, 2 * LANES)).astype(np.uint8)
    out, four = np.zeros_like(vectors), np.zeros(4, np.uint8)
    lowest_of_four_wide(vectors.reshape(-1), out.reshape(-1), four)
    np.testing.assert_array_equal(four, vectors.min(axis=1))
    np.testing.assert_array_equal(out, np.repeat(four[:, None], 2 * LANES, axis=1))
