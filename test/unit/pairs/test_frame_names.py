# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Names of image files, as recorders write them, never pair two frames, whatever is missing."""
from itertools import permutations
from types import SimpleNamespace

from fuzzed import examples
from fuzzy_stereo_ros.pairs.frames import stamps_of
from hypothesis import given, strategies as st
import pytest

SECOND, MS, US = 10**9, 10**6, 10**3
COUNT = 45
START = 1_738_133_056_812_345_678      # ns


def decimals(time, unit, digits):
    return f'{time // unit}.{time % unit * 10**digits // unit:0{digits}}'


def parts(sign, width=''):
    """Return how seconds and nanoseconds stand in a name, with or without leading zeros."""
    return lambda n, t: f'{t // SECOND}{sign}{t % SECOND:{width}}'


# {what names have: (it, of frame n, taken at t, ns; the unit of this time, None if it is none)}
MOMENTS = {
    's.ns': (parts('.', '09'), 1), 's-ns': (parts('-', '09'), 1),
    's.ns as counted': (parts('.'), 1), 's_ns as counted': (parts('_'), 1),
    's.us': (lambda n, t: decimals(t, SECOND, 6), US),
    's_us': (lambda n, t: f'{t // SECOND}_{t // US % 10**6:06}', US),
    'time.time()': (lambda n, t: f'{t // MS / 1000}', MS),
    'ms': (lambda n, t: f'{t // MS}', MS), 'us': (lambda n, t: f'{t // US}', US),
    'ns': (lambda n, t: f'{t}', 1),
    'ms of rs-convert': (lambda n, t: decimals(t, MS, 14), 1),
    's of a simulation': (lambda n, t: parts('.', '09')(n, t - START), 1),
    'ms since a start': (lambda n, t: decimals(t - START, MS, 14), 1),
    'a number and us': (lambda n, t: f'{n:06}_{t // US}', US),
    'number': (lambda n, t: f'{n}', None), '10 digits': (lambda n, t: f'{n:010}', None),
    'two numbers': (lambda n, t: f'{n // 2:06}_{10 + n % 2}', None),
    'two numbers without zeros': (lambda n, t: f'{n // 10}.{n % 10}', None),
    'seconds and a number': (lambda n, t: f'{1738133056 + n // 30}_{n % 30:02}', None),
    'seconds and a count': (lambda n, t: f'{1738133056 + n // 30}_{n:03}', None),
    'the start and a number': (lambda n, t: f'1738133056_{n:06}', None),
    'a date': (lambda n, t: f'20250129_12{n // 60:02}{n % 60:02}123', None),
    'a letter': (lambda n, t: f"{n // 3}{'abc'[n % 3]}", None)}
SINCE_A_START = 's of a simulation', 'ms since a start'
CAMERAS = (('', ''), ('left', 'right'), ('Left', 'Right'), ('L', 'R'), ('l', 'r'),
           ('cam0', 'cam1'), ('cam_1', 'cam_2'), ('camera-0', 'camera-1'), ('infra1', 'infra2'),
           ('Infrared_1', 'Infrared_2'), ('Infrared 1', 'Infrared 2'), ('ir0', 'ir1'))
OTHERS = ('', 'IMG', 'image_raw', 'rs', 'a.b', 'run_7', 'x12', 'left_arm')
FRAMES = st.sets(st.integers(0, COUNT - 1), min_size=1, max_size=12)


@st.composite
def recordings(draw, moment):
    """Return names of both cameras of all frames, the frames each has, and their times."""
    step = draw(st.sampled_from([8_333_333, 33_333_333, SECOND]))
    times = [START + n * step + draw(st.integers(0, 5 * MS)) for n in range(COUNT)]
    cameras, other = draw(st.sampled_from(CAMERAS)), draw(st.sampled_from(OTHERS))
    order, sign = draw(st.sampled_from([*permutations(range(3))])), draw(st.sampled_from('_- .'))
    sign = '_' if sign == '.' and (other + cameras[0])[-1:].isdigit() else sign
    names = [[sign.join(filter(None, ((moment(n, time), camera, other)[i] for i in order)))
              for n, time in enumerate(times)] for camera in cameras]
    return SimpleNamespace(names=names, times=times, there=draw(st.tuples(FRAMES, FRAMES)))


def pairs_of(stems, rate=None):
    """Return [(stamp, left name, right name)] of equal stamps in their order."""
    stamps, _ = stamps_of('a and b', stems, rate)
    left, right = (dict(zip(*side)) for side in zip(stamps, stems))
    assert [len(left), len(right)] == [*map(len, stems)], 'two frames of a camera have one stamp'
    return [(stamp, left[stamp], right[stamp]) for stamp in sorted(left.keys() & right.keys())]


@pytest.mark.parametrize('name', MOMENTS)
@examples(12)
@given(data=st.data(), rate=st.sampled_from([None, None, 30.0]))
def test_the_frames_that_both_cameras_have_are_pairs_in_order_and_no_others(name, data, rate):
    moment, unit = MOMENTS[name]
    recording = data.draw(recordings(moment))
    names, both = recording.names, sorted(set.intersection(*recording.there))
    stems = [sorted(side[n] for n in there) for side, there in zip(names, recording.there)]
    try:
        found = pairs_of(stems, rate)
    except ValueError as error:
        assert not both, error
        return
    assert [pair[1:] for pair in found] == [(names[0][n], names[1][n]) for n in both]
    if rate is None and unit is not None:
        start = START if name in SINCE_A_START else 0
        for n, (stamp, *_) in zip(both, found):
            assert abs(stamp + start - recording.times[n]) <= unit + 512
    elif min(map(len, stems)) > 1 and not (rate is None and name.startswith('seconds')):
        assert all(stamp < COUNT * SECOND / (rate or 10) for stamp, *_ in found)


@pytest.mark.parametrize('left, right', [
    ('{:03}_0', '{:03}_1'), ('18284511-{}', '18284522-{}'), ('im1_{:05}', 'im2_{:05}')])
def test_a_number_of_the_camera_is_seen_in_many_names_of_which_none_is_missing(left, right):
    names = [[side.format(n) for n in range(8)] for side in (left, right)]
    assert [pair[1:] for pair in pairs_of(names)] == [*zip(*names)]
    for lost in range(8):
        with pytest.raises(ValueError, match='do not tell which images belong together'):
            pairs_of([names[0], names[1][:lost] + names[1][lost + 1:]])


@pytest.mark.parametrize('left, right', [
    (['000000_10', '000001_11'], ['000002_10', '000003_11']), (['1', '3'], ['2', '4']),
    (['a', 'b'], ['c', 'd']), (['camera_1'], ['camera_2']), (['1_1738133056'], ['2_1738133056']),
    (['000000_10', '000001_10', '000002_10'], ['000000_11', '000001_11', '000002_11']),
    (['a_1', 'b_2'], ['a_2', 'b_1']), (['x_7.0000000001'], ['x_7.0000000002'])])
def test_names_of_different_frames_make_no_pair_though_they_are_as_many(left, right):
    with pytest.raises(ValueError, match=f'as {left[0]} and {right[0]} do not tell which images'):
        stamps_of('a and b', [left, right])


@examples(25)
@given(st.sets(st.integers(0, 2000), min_size=1, max_size=12), st.sets(st.integers(0, 2000)),
       st.tuples(st.integers(1, 6), st.integers(1, 6)), st.sampled_from(CAMERAS),
       st.tuples(st.sampled_from(OTHERS), st.sampled_from(OTHERS)), st.booleans(),
       st.sampled_from([10, 20.0, 30]))
def test_equal_numbers_pair_whatever_zeros_and_words_stand_before_them(
        both, lost, widths, cameras, others, alike, rate):
    """Also where some have no zeros to lose: 10 and 010, but 100 and 100."""
    if alike or any(map(str.isdigit, ''.join(others))):
        others = (others[0],) * 2
    names = [{n: '_'.join(filter(None, (other, camera, f'{n:0{width}}'))) for n in both | own}
             for camera, other, width, own in zip(cameras, others, widths, (lost - both, set()))]
    found = pairs_of([sorted(side.values()) for side in names], rate)
    assert [pair[1:] for pair in found] == [(names[0][n], names[1][n]) for n in sorted(both)]
    assert len(both | lost) < 2 or [pair[0] for pair in found] == [
        round(n * SECOND / rate) for n in sorted(both)]
