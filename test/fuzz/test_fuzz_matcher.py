# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Arrays of every kind, size and stride, and values of every type, into the public face."""
from dataclasses import fields, replace
from fractions import Fraction
import math

from fuzzed import examples
from fuzzy_stereo_ros.matching import MatcherConfig, PROFILES, StereoMatcher
from fuzzy_stereo_ros.matching.matcher import MOST_PIXELS, MOST_SIDE
from hypothesis import given, settings, strategies as st
from hypothesis.extra import numpy as arrays
import numpy as np
import pytest

KINDS = st.one_of(
    st.sampled_from([np.uint8, np.uint16]), st.sampled_from([np.uint8, np.uint16]),
    arrays.scalar_dtypes(), st.sampled_from([np.dtype('>u2'), np.dtype('u1,u1')]))
SHAPES = st.one_of(
    st.tuples(st.integers(0, 40), st.integers(0, 60)),
    st.tuples(st.integers(0, 40), st.integers(0, 60), st.integers(0, 5)),
    arrays.array_shapes(min_dims=0, max_dims=4, min_side=0, max_side=9))
STEPS = st.tuples(*2 * [st.sampled_from([1, 1, 2, 3, -1, -2])])
EDGES = [0, 1, 127, 128, 254, 255, 256, 2**15, 2**16 - 1]


def noise(kind, shape, seed):
    """Return an array of random bytes, so of any values of its kind, NaN and infinite as well."""
    size = math.prod(shape) * np.dtype(kind).itemsize
    random = np.random.default_rng(seed)
    return np.frombuffer(random.bytes(size), kind).reshape(shape)


def edges(kind, shape, seed):
    """Return an array of the extremes of whole numbers, where it has a kind of them."""
    if np.dtype(kind).kind not in 'iu':
        return noise(kind, shape, seed)
    random = np.random.default_rng(seed)
    return random.choice(EDGES, shape).astype(kind)


def spread(array, steps):
    """Return an array of the same values that are not next to each other in memory."""
    if array.ndim < 2:
        return array
    rows, columns, *rest = array.shape
    wide = np.empty((rows * abs(steps[0]), columns * abs(steps[1]), *rest), array.dtype)
    view = wide[::steps[0], ::steps[1]]
    view[:] = array
    return view


def unaligned(array):
    """Return an array of the same values that begins at an odd address."""
    memory = bytearray(array.nbytes + 1)
    moved = np.ndarray(array.shape, array.dtype, memory, 1)
    moved[...] = array
    return moved


def configs():
    """Return a strategy of configurations for small images, of each profile."""
    return st.builds(
        lambda profile, disparities, generations, **changes: MatcherConfig.from_profile(
            profile, disparities=disparities, generations=generations, population=3, threads=1,
            **changes),
        st.sampled_from(sorted(PROFILES)), st.one_of(st.integers(1, 60), st.integers(1, 4096)),
        st.integers(0, 2),
        min_disparity=st.one_of(st.integers(-70, 70), st.integers(-2048, 2048)),
        fill=st.booleans(), confidence_threshold=st.floats(0, 1),
        speckle_size=st.integers(0, 50), speckle_range=st.integers(0, 255),
        warm_start=st.booleans(), reference=st.sampled_from(['left', 'right']),
        seed=st.integers(0, 2**31 - 1), neighbourhood=st.sampled_from([1, 3, 31]),
        mutation_rate=st.floats(0, 1),
        reading=st.sampled_from(['literal', 'uniform']),
        initial_population=st.sampled_from(['random', 'winner_takes_all']))


def assert_sound(match, shape, config):
    """Assert what holds of every match."""
    assert match.disparity.shape == match.confidence.shape == shape
    assert match.disparity.dtype == match.confidence.dtype == np.float32
    valid = match.disparity[~np.isnan(match.disparity)]
    assert np.all(valid >= config.min_disparity - 0.5)
    assert np.all(valid <= config.min_disparity + config.disparities - 0.5)
    assert np.all((match.confidence >= 0) & (match.confidence <= 1))
    invalid = match.confidence[np.isnan(match.disparity)]
    assert np.all((invalid == 0) | (invalid < config.confidence_threshold))
    assert len(match.history) == match.generations <= config.generations


@settings(examples(120), deadline=None)     # some compile a kernel
@given(configs(), KINDS, SHAPES, STEPS, st.sampled_from([noise, edges]), st.booleans(),
       st.data())
def test_arrays_of_any_kind_are_matched_or_rejected(
        config, kind, shape, steps, make, odd, data):
    left = make(kind, shape, 0)
    other_kind, other_shape = data.draw(st.one_of(
        st.just((kind, shape)), st.just((kind, shape)), st.just((kind, shape)),
        st.tuples(KINDS, SHAPES)))
    right = make(other_kind, other_shape, 1)
    given_pair = [unaligned(each) if odd and not each.dtype.hasobject else spread(each, steps)
                  for each in (left, right)]
    before = [each.tobytes() for each in given_pair]
    matcher = StereoMatcher(config)
    try:
        matches = [matcher.match(*given_pair) for _ in range(2)]
    except ValueError as rejection:
        assert str(rejection).isprintable() and ' ' in str(rejection)
        assert left.dtype not in (np.uint8, np.uint16) or left.shape != right.shape \
            or left.dtype != right.dtype or left.ndim not in (2, 3) \
            or left.shape[-1] not in (1, 3) and left.ndim == 3 or min(left.shape[:2]) < 2 \
            or config.disparities > left.shape[1]
        return
    for match in matches:
        assert_sound(match, left.shape[:2], config)
    assert [each.tobytes() for each in given_pair] == before
    plain = StereoMatcher(config).match(left, right)
    np.testing.assert_array_equal(plain.disparity, matches[0].disparity)
    np.testing.assert_array_equal(plain.confidence, matches[0].confidence)


@pytest.mark.parametrize('shape', [(2**31, 2**31), (2, MOST_PIXELS // 2 + 1), (2, MOST_SIDE + 1),
                                   (MOST_SIDE + 1, 2)])
def test_images_of_more_pixels_than_can_be_numbered_take_no_memory(shape):
    image = np.broadcast_to(np.uint8(7), shape)
    with pytest.raises(ValueError, match=f'at most {MOST_PIXELS} pixels, and {MOST_SIDE} a side'):
        StereoMatcher(MatcherConfig(threads=1)).match(image, image)


@pytest.mark.parametrize('stamp', [1.5, math.nan, 'now', b'1', [1], np.datetime64(5, 'ns')])
def test_a_stamp_that_is_no_whole_number_is_rejected_and_the_next_frame_is_as_without(stamp):
    config = MatcherConfig(disparities=8, threads=1)
    matcher, other = StereoMatcher(config), StereoMatcher(config)
    image = noise(np.uint8, (20, 30), 0)
    for one in (matcher, other):
        one.match(image, image, stamp=1)
    with pytest.raises(ValueError, match='the stamp is .*; allowed are whole numbers of ns'):
        matcher.match(image, image, stamp=stamp)
    expected, found = (one.match(image, image, stamp=2) for one in (other, matcher))
    assert found.warm and expected.warm
    np.testing.assert_array_equal(found.disparity, expected.disparity)


NAMES = [field.name for field in fields(MatcherConfig)]
VALUES = st.one_of(
    st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=9), st.binary(),
    st.integers(-9, 300), st.floats(-1, 70), st.fractions(), st.lists(st.integers(), max_size=3),
    st.sampled_from([10**400, -10**400, Fraction(10**400), np.int64(5), np.float32('nan'),
                     np.array([1, 2]), np.array(['left', 'right']), np.bool_(True), 1j, {}]),
    st.sampled_from(['realtime', 'quality', 'paper', 'left']))


@examples(400)
@given(st.dictionaries(st.sampled_from(NAMES), VALUES, max_size=3))
def test_a_configuration_takes_a_value_or_rejects_it_by_name(changes):
    try:
        config = MatcherConfig(**changes)
    except ValueError as rejection:
        name, rest = str(rejection).split(' is ', 1)
        assert name in changes
        assert '; allowed are ' in rest
        return
    assert replace(config) == config
    for field in fields(config):
        value, row = getattr(config, field.name), field.metadata['row']
        assert row.low is None or row.low <= value <= row.high


# ---- known answers of whole matches where integers are narrow ----

FULL = 2**16 - 1
BORDER = 6      # px, where windows reach beyond the image
COUNTS = st.integers(1, 512) | st.sampled_from([1, 2, 31, 33, 255, 256, 257, 512])
LEVELS = st.sampled_from([(0, 255), (0, 1023), (0, 4095), (0, FULL), (FULL - 4096, FULL), (0, 1),
                          (30000, 34000)])


@pytest.mark.parametrize('profile', ['realtime', 'quality'])
@settings(examples(40), deadline=None)     # some compile a kernel
@given(disparities=COUNTS, least=st.sampled_from([0, -2048, 2048]) | st.integers(-400, 300),
       place=st.sampled_from([0, -1]), levels=LEVELS, seed=st.integers(0, 99))
def test_the_first_and_the_last_disparity_of_any_range_are_found_in_any_grey_levels(
        profile, disparities, least, place, levels, seed):
    """Of random patches of 2 x 2 pixels in few or many grey levels, of 8 or 16 bits."""
    disparities = min(disparities, 24) if levels[1] == 1 else disparities
    config = MatcherConfig.from_profile(
        profile, threads=1, generations=1, speckle_size=0, disparities=disparities,
        min_disparity=least)
    shift = range(least, least + disparities)[place]
    margin, columns = abs(shift), max(disparities, abs(shift)) + 99
    whole = np.random.default_rng(seed).integers(
        *levels, (15, columns // 2 + margin + 1), np.uint8 if levels[1] == 255 else np.uint16,
        endpoint=True).repeat(2, axis=0).repeat(2, axis=1)
    left, right = (np.ascontiguousarray(whole[:, begin:begin + columns])
                   for begin in (margin, margin + shift))
    found = StereoMatcher(config).match(left, right).disparity[
        :, max(0, shift) + BORDER:columns - max(0, -shift) - BORDER]
    assert np.mean(np.abs(found - shift) < 0.5) > 0.98
