# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What `fuzzy-stereo replay` writes: every pair, as the matcher finds it, at the bag's times."""
from collections import Counter
import json

import cv2
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.matching.match import colour_disparity
from fuzzy_stereo_ros.pairs.disparity_files import read_disparity
from fuzzy_stereo_ros.pairs.messages import read_image, stamp_of
from fuzzy_stereo_ros.pairs.pair_reader import PairReader
from fuzzy_stereo_ros.pairs.result_messages import ResultMessages
from made_bags import (
    BagOf, BASELINE, BEGIN, COLUMNS, content, DISPARITIES, disparities, FOCAL, FORMATS, LATER,
    ROWS, same, scene, stamps, STEP, TOPICS, write_bag)
from made_messages import values_of
import numpy as np
import pytest
from replayed import (
    as_sent, assert_same, chatter, figures, matches, rejection, replay, restamp, sent)

LAST_OF_A_PAIR = 3      # ns, that a pair's last message is recorded after its first


def assert_matched(path, pairs, chosen=None):
    """Compare the disparities of a bag with those that the matcher finds."""
    pairs = list(zip(stamps(len(pairs)), pairs))[chosen or slice(None)]
    assert list(disparities(path)) == [stamp for stamp, _ in pairs]
    assert_same(sent(path), as_sent(matches(
        [pair for _, pair in pairs], [stamp for stamp, _ in pairs])))


@pytest.mark.parametrize(('form', 'storage'), zip(FORMATS, ('mcap', 'sqlite3', 'mcap')))
def test_every_pair_is_matched_as_the_matcher_does_it_warm_and_bit_for_bit(folder, form, storage):
    """And stands in the bag at the time at which it was complete, with its preview."""
    name = 'bag.bag' if form == 'ros1' else 'bag'
    write_bag(folder / name, form)
    assert replay(name, options=['--format', storage]) == 0
    written = content(folder / 'out')
    found, previews = ([one for one in written if one[0] == f'/{topic}']
                       for topic in ('disparity', 'preview'))
    warm, cold = (matches(scene(), stamps(), warm_start=start) for start in (True, False))
    assert not np.array_equal(warm[-1].disparity, cold[-1].disparity, equal_nan=True)
    for (_, at, message), (_, shown_at, preview), sought, match, stamp in zip(
            found, previews, as_sent(warm), warm, stamps(), strict=True):
        np.testing.assert_array_equal(values_of(message.image), sought)
        assert stamp_of(message.header) == stamp_of(message.image.header) == stamp
        assert (message.f, message.min_disparity, message.max_disparity) == (
            FOCAL, 0, DISPARITIES - 1)
        assert message.t == pytest.approx(BASELINE)
        assert at == shown_at == stamp + LATER + LAST_OF_A_PAIR
        assert preview.encoding == 'bgr8'
        assert preview.header.frame_id == message.header.frame_id == 'left_optical'
        np.testing.assert_array_equal(
            read_image(preview), colour_disparity(match.disparity, 0, DISPARITIES - 1))


def test_the_other_results_are_written_where_they_are_asked_for(folder):
    write_bag(folder / 'bag')
    assert replay('bag', options=[
        '--with', 'points2', 'depth', 'confidence', '--depth-encoding', '16UC1',
        '--no-use-color']) == 0
    written = content(folder / 'out')
    last = {topic: message for topic, _, message in written}
    assert {topic: message.__msgtype__.split('/')[-1] for topic, message in last.items()} == {
        '/disparity': 'DisparityImage', '/preview': 'Image', '/confidence': 'Image',
        '/depth/image_rect': 'Image', '/depth/camera_info': 'CameraInfo',
        '/points2': 'PointCloud2'}
    assert set(Counter(topic for topic, *_ in written).values()) == {6}
    matched = matches(scene(), stamps())
    confidence, depth, points = (last[f'/{topic}'] for topic in (
        'confidence', 'depth/image_rect', 'points2'))
    np.testing.assert_array_equal(values_of(confidence), matched[-1].confidence)
    assert depth.encoding == '16UC1'
    assert [field.name for field in points.fields] == ['x', 'y', 'z']
    z = points.data.view('<f4').reshape(ROWS, COLUMNS, 3)[:, :, 2]
    near = matched[-1].disparity >= 3       # farther points are left out
    assert np.isnan(z[~near]).all()
    np.testing.assert_allclose(z[near], FOCAL * BASELINE / matched[-1].disparity[near], rtol=1e-5)
    millimetres = depth.data.view('<u2').reshape(ROWS, COLUMNS)
    np.testing.assert_allclose(millimetres[near], 1000 * z[near], atol=0.51)


def test_compressed_images_and_several_bags_are_matched_too(folder):
    topics = ('/rig/infra1/image_rect/compressed', '/rig/infra1/camera_info',
              '/rig/infra2/image_rect/compressed', '/rig/infra2/camera_info')
    pairs = scene(8)
    write_bag(folder / 'a.bag', 'ros1', pairs[:4], topics, BagOf.compressed)
    write_bag(folder / 'b', 'sqlite3', pairs[4:], topics, BagOf.compressed, first=4)
    assert replay('b', 'a.bag') == 0
    assert_matched(folder / 'out', pairs)


def test_options_of_the_node_reach_what_reads_the_pairs(folder, capsys):
    write_bag(folder / 'bag')
    assert figures(capsys, 'bag', options=['--scale', '0.5'])['pairs']['matched'] == 6
    half = MatcherConfig(disparities=DISPARITIES).at_scale(0.5)
    for _, _, message in content(folder / 'out', '/disparity'):
        assert values_of(message.image).shape == (ROWS // 2, COLUMNS // 2)
        assert (message.f, message.max_disparity) == (FOCAL / 2, half.disparities - 1)


def test_raw_images_are_rectified_where_that_is_asked_for(folder, capsys):
    topics = [topic.replace('rect', 'raw') for topic in TOPICS]

    def distort(number, messages):
        for topic in topics[1::2]:
            messages[topic].d = np.array([-0.3, 0.1, 0, 0, 0])

    write_bag(folder / 'bag', topics=topics, change=distort)
    assert replay('bag', output='plain') == 0
    assert ('/left/image_raw and /right/image_raw are matched without rectification; give '
            '--rectify if they are raw images') in capsys.readouterr().err.splitlines()
    assert figures(capsys, 'bag', output='rectified', options=['--rectify'])['remarks'] == []
    assert_matched(folder / 'plain', scene())
    assert not np.array_equal(sent(folder / 'plain')[0], sent(folder / 'rectified')[0])


def test_cameras_that_do_not_stamp_alike_are_joined_where_that_is_asked_for(folder, capsys):
    def shift(number, messages):
        for topic in TOPICS[2:]:
            messages[topic].header.stamp.nanosec += 1_000_000

    write_bag(folder / 'bag', change=shift)
    sentence = rejection(capsys, 'bag')
    assert 'bag: no messages were synchronised; received: /left/image_rect 6, ' in sentence
    assert sentence.endswith(
        '; the latest stamps differ by up to 1.000 ms; give --approximate if the cameras do not '
        'stamp alike, --cache-camera-info if camera_info is published rarely, or a larger '
        '--queue-size')
    assert not (folder / 'out').exists()
    assert replay('bag', options=['--approximate']) == 0
    assert_matched(folder / 'out', scene())
    assert 'raise --tolerance' in rejection(
        capsys, 'bag', output='other', options=['--approximate', '--tolerance', '0.0005'])


def test_a_camera_info_that_came_once_is_kept_where_that_is_asked_for(folder, capsys):
    def only_once(number, messages):
        for topic in TOPICS[1::2] if number else ():
            del messages[topic]

    write_bag(folder / 'bag', change=only_once)
    assert replay('bag', output='one') == 0
    assert ('\nto synchronise more of them, give --approximate if the cameras do not stamp alike, '
            '--cache-camera-info if camera_info is published rarely') in capsys.readouterr().out
    # The first images come before the camera_info of their pair.
    for first in (0, 2):
        assert replay('bag', output=first, options=[
            '--start', first * STEP / 1e9, '--cache-camera-info']) == 0
        assert_matched(folder / f'{first}', scene(), slice(first, None))


def test_a_part_of_the_bag_and_some_of_its_pairs_can_be_chosen(folder, capsys):
    write_bag(folder / 'bag', pairs=scene(10))
    second = 1e-9 * STEP
    assert replay('bag', options=['--start', 2 * second, '--duration', 7 * second,
                                  '--every', 3]) == 0
    assert_matched(folder / 'out', scene(10), slice(2, 9, 3))
    for number, duration in enumerate((1e10, 1e308)):       # beyond the end
        assert replay('bag', output=number, options=['--duration', duration, '--every', 5]) == 0
        assert_matched(folder / f'{number}', scene(10), slice(0, 10, 5))


def test_files_are_named_by_stamp_with_the_last_calibration(folder, capsys):
    """Beside a bag: see test_replay_ends.py."""
    def changed(number, messages):
        if number >= 3:
            for topic in TOPICS[1::2]:
                messages[topic].p[:] *= [2, 1, 1, 2, 1, 2, 1, 1, 1, 1, 1, 1]

    write_bag(folder / 'bag', change=changed)
    assert figures(capsys, 'bag', options=[
        '--files', 'npy', 'pfm', 'png', '--format', 'none'])['remarks'] == [
        'the calibration changed; calibration.json of --files is the one of the last pairs']
    assert {path.name for path in (folder / 'out').iterdir()} == {
        'calibration.json', 'disparity', 'progress.json', 'replay.json'}
    for stamp, match in zip(stamps(), matches(scene(), stamps())):
        for suffix, most in (('npy', 0), ('pfm', 0), ('png', 0.01)):
            found = read_disparity(folder / 'out' / 'disparity' / f'{stamp:019d}.{suffix}')
            np.testing.assert_array_equal(np.isnan(found), np.isnan(match.disparity))
            assert np.nanmax(abs(found - match.disparity)) <= most
    calibration = json.loads((folder / 'out' / 'calibration.json').read_text())
    assert (calibration['focal'], calibration['baseline']) == (2 * FOCAL, BASELINE)


def test_topics_are_copied_in_their_order_of_time_between_the_results(folder, capsys):
    write_bag(folder / 'bag', more=chatter)
    assert replay('bag', options=['--keep']) == 0
    copied, written = (content(folder / name) for name in ('bag', 'out'))
    times = [log_time for _, log_time, _ in written]
    assert times == sorted(times)
    after = [one for one in written if one[0] not in ('/disparity', '/preview')]
    assert [one[:2] for one in after] == [one[:2] for one in copied]
    assert all(same(one[2], other[2]) for one, other in zip(copied, after))
    # The results of an earlier replay are no obstacle, but give way to the new ones.
    assert replay('out', output='twice', options=['--keep', 'chatter', '/left/image_rect']) == 0
    assert Counter(topic for topic, *_ in content(folder / 'twice')) == {
        '/chatter': 12, '/left/image_rect': 6, '/disparity': 6, '/preview': 6}
    assert rejection(capsys, 'out', output='other', options=['--keep', '/disparity']) == (
        '--keep names /disparity, under which the results are written')


def test_bad_pairs_are_counted_and_logged_once_and_the_others_matched(folder, capsys):
    def spoil(number, messages):
        if number in (1, 3):
            messages[TOPICS[0]].encoding = 'nonsense'
        if number == 4:
            messages[TOPICS[2]] = b'\0\1\0\0\1'

    write_bag(folder / 'bag', pairs=scene(8), change=spoil)
    assert replay('bag') == 0
    assert list(disparities(folder / 'out')) == [stamps(8)[place] for place in (0, 2, 5, 6, 7)]
    printed = capsys.readouterr()
    assert "pair 1000.033 rejected: left image: encoding is 'nonsense'; allowed" in printed.err
    assert printed.err.count("encoding is 'nonsense'") == 1
    assert printed.err.count(
        'message rejected: a message of /right/image_rect cannot be read') == 1
    assert '3 rejected: damaged message 1, encoding 2' in printed.out
    assert 'messages not synchronised: /left/image_rect 1 of 8' in printed.out
    assert 'to synchronise more of them' not in printed.out


@pytest.mark.parametrize('where, name, error', [
    (PairReader, 'read', cv2.error('Assertion failed')), (StereoMatcher, 'match', MemoryError()),
    (ResultMessages, 'of', MemoryError())], ids=['reading', 'matching', 'results'])
def test_any_exception_rejects_only_its_pair(folder, capsys, monkeypatch, where, name, error):
    work, bad = getattr(where, name), read_image(content(write_bag(folder / 'bag'))[12][2])

    def failing(worker, first, *others, **options):
        if name == 'of':
            image = others[0].pair.left if first == 'points2' else None
        else:
            image = read_image(first) if name == 'read' else first
        if np.array_equal(image, bad):
            raise error
        return work(worker, first, *others, **options)

    monkeypatch.setattr(where, name, failing)
    assert replay('bag', options=['--with', 'points2', '--json']) == 0
    told = capsys.readouterr()
    found = json.loads(told.out)['pairs']
    assert (found['matched'], found['rejected']) == (5, {'internal error': 1})
    assert found['warm'] == {'read': 4, 'match': 3, 'of': 5}[name]
    written = content(folder / 'out')
    for topic in ('/disparity', '/preview', '/points2'):
        assert [stamp_of(message.header) for name, _, message in written if name == topic] == (
            stamps()[:3] + stamps()[4:])
    what = 'results' if name == 'of' else 'pair 1000.100'
    assert f'{what} rejected: internal error, {type(error).__name__}: ' in told.err


def test_a_jump_back_between_two_selected_pairs_resets_the_matcher(folder, capsys):
    write_bag(folder / 'bag', pairs=scene(8), change=lambda number, messages: restamp(
        messages, BEGIN + number % 4 * STEP))
    found = figures(capsys, 'bag', options=['--every', 5])
    assert [stamp_of(message.header) for _, _, message in content(
        folder / 'out', '/disparity')] == stamps(2)
    assert found['pairs']['warm'] == 0
