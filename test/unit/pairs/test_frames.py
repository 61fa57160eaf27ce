# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Frames are found in what recorders leave and paired by names, and what is no frame is not."""
from itertools import permutations
from types import SimpleNamespace

import cv2
from fuzzed import examples
from fuzzy_stereo_ros.pairs.frames import are_pairs, Frames, LAYOUTS, stamps_of
from fuzzy_stereo_ros.pairs.image_files import write_image
from hypothesis import given, strategies as st
import numpy as np
import pytest


def written(folder, names):
    """Write an image for each name, of the level that is its place; return the folder."""
    for number, name in enumerate(names):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        write_image(folder / name, np.full((4, 6), number, np.uint8))
    return folder


def levels(*paths):
    """Return the level of the left and of the right image of each pair."""
    return [(int(left.read()[0, 0]), int(right.read()[0, 0]))
            for _, left, right in Frames(paths).pairs()]


@pytest.mark.parametrize('names', [
    ['left-0000', 'right-0000', 'left-0001', 'right-0001'],         # camera_calibration
    ['left000000', 'right000000', 'left000001', 'right000001', 'depth000000'],      # ZED
    ['rs_Infrared_1_1738133056812.3', 'rs_Infrared_2_1738133056812.3',
     'rs_Infrared_1_1738133056845.6', 'rs_Infrared_2_1738133056845.6',
     'rs_Color_1738133056812.3'],
    ['0007_L', '0007_R', '0008_L', '0008_R', '0009_L', '.0009_R'],
    ['cam0_left_arm_3', 'cam1_left_arm_3', 'cam0_left_arm_12', 'cam1_left_arm_12'],
    ['left_arm/a_left', 'left_arm/a_right', 'left_arm/b_left', 'left_arm/b_right']])
def test_one_folder_with_the_images_of_both_cameras_is_paired_by_their_names(tmp_path, names):
    folder = written(tmp_path, [f'{name}.png' for name in names]) / names[0].rpartition('/')[0]
    assert are_pairs([folder]) and levels(folder) == [(0, 1), (2, 3)]
    assert str(folder / '*') in Frames([folder]).name


@pytest.mark.parametrize('layout', LAYOUTS)
def test_the_folders_of_both_cameras_are_found_in_that_of_a_recording(tmp_path, layout):
    times = [1403636579763555584, 1403636579813555456]
    folder = written(tmp_path, [f'{side}/{time}.png' for time in times for side in layout])
    frames = Frames([folder])
    assert levels(folder) == [(0, 1), (2, 3)]
    assert [stamp for stamp, _, _ in frames.pairs()] == [frames.begin, frames.end] == times


def test_a_folder_of_one_camera_or_of_four_is_none_of_two(tmp_path):
    one = written(tmp_path / 'one', [f'camera_{number}.png' for number in range(2)])
    four = written(tmp_path / 'four', [f'cam{number}_0.png' for number in range(4)])
    for folder in (one, four):
        assert not are_pairs([folder])
        with pytest.raises(ValueError, match='no images that are named by their camera'):
            Frames([folder])


def test_hidden_files_and_companions_of_other_systems_are_no_images(tmp_path):
    folder = written(tmp_path, ['left/0.png', 'right/0.png', 'left/1.png', 'right/1.png'])
    for name in ('left/._0.png', 'right/._1.png', 'left/.2.png', 'left/Thumbs.db',
                 'right/desktop.ini', 'left/0.png:Zone.Identifier', '__MACOSX/._left'):
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_bytes(b'\0\5\x16\7\0\2\0\0Mac OS X')
    for paths in ([folder], [folder / 'left', folder / 'right'],
                  [f'{folder}/left/*', f'{folder}/right/*'],
                  [f'{folder}/left/*', f'{folder}/right/[.0-9]*']):
        assert levels(*paths) == [(0, 1), (2, 3)]


def test_equal_names_in_several_folders_pair_within_each(tmp_path):
    written(tmp_path, [f'{run}/{side}/{number}.PNG' for run in ('b', 'a') for number in (10, 9)
                       for side in ('left', 'right')] + ['a/left/8.PNG', 'b/right/8.PNG'])
    assert levels(f'{tmp_path}/*/left/*', f'{tmp_path}/*/right/*') == [
        (6, 7), (4, 5), (2, 3), (0, 1)]


@pytest.mark.parametrize('count', [1, 45])
def test_a_video_that_does_not_know_its_length_is_read_to_its_end(tmp_path, count):
    video = cv2.VideoWriter(str(tmp_path / 'whole.mkv'), cv2.VideoWriter.fourcc(*'MJPG'), 30.,
                            (320, 120))
    for number in range(count):
        video.write(np.full((120, 320, 3), 5 * number, np.uint8))
    video.release()
    content = (tmp_path / 'whole.mkv').read_bytes()
    place = content.index(b'\x44\x89\x88')      # of its duration; live recorders write a void
    (tmp_path / 'live.mkv').write_bytes(content[:place] + b'\xec\x89' + content[place + 2:])
    for name in ('whole.mkv', 'live.mkv'):
        frames = Frames([tmp_path / name])
        stamps = [stamp for stamp, _, _ in frames.pairs()]
        assert stamps == [round(number * 1e9 / 30) for number in range(count)]
        assert (frames.counts, frames.end) == ({'left': count, 'right': count}, stamps[-1])
        assert [round(frame.read().mean() / 5) for _, frame, _ in frames.pairs()] == [
            *range(count)]


def test_a_video_is_read_as_it_is_stored_whatever_its_orientation(tmp_path):
    """As images are: turned, the rows of a pair would be its columns."""
    video = cv2.VideoWriter(str(tmp_path / 'left.mp4'), cv2.VideoWriter.fourcc(*'mp4v'), 30.,
                            (64, 32))
    video.write(np.zeros((32, 64, 3), np.uint8))
    video.release()
    content = (tmp_path / 'left.mp4').read_bytes()
    place = content.index(b'tkhd') + 44         # of the matrix
    turned = np.array([0, 1 << 16, 0, -1 << 16, 0, 0, 32 << 16, 0, 1 << 30], '>i4').tobytes()
    (tmp_path / 'right.mp4').write_bytes(content[:place] + turned + content[place + 36:])
    (_, left, right), = Frames([tmp_path / 'left.mp4', tmp_path / 'right.mp4']).pairs()
    assert left.read().shape == right.read().shape == (32, 64, 3)


# ---- names, as recorders write them, never pair two frames, whatever is missing ----


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
