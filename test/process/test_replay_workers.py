# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""`fuzzy-stereo replay` on workers: always the same segments, whoever matches them and dies."""
from concurrent.futures import ThreadPoolExecutor
import signal

from dask_processes import dask_processes
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.pairs.image_files import write_image
from fuzzy_stereo_ros.replay.options import SEGMENT_PAIRS, WARM_PAIRS
from made_bags import (
    BEGIN, content, DISPARITIES, disparities, scene, stamps, STEP, TOPICS, write_bag)
from made_messages import values_of
import numpy as np
import pytest
from replayed import figures, replay

PAIRS = 2 * SEGMENT_PAIRS + 20
HALTING = """\
import threading
from fuzzy_stereo_ros.replay import segments
match, pairs = segments.match_or_reject, []
def halting(pair, matcher):
    pairs.append(None)
    if len(pairs) == 30:
        print('in the middle', flush=True)
        threading.Event().wait()
    return match(pair, matcher)
segments.match_or_reject = halting
"""


@pytest.fixture(scope='module')
def cluster(tmp_path_factory):
    """Give a scheduler with two workers."""
    with dask_processes(tmp_path_factory.mktemp('dask')) as processes:
        for _ in range(2):
            processes.worker()
        yield processes


def in_segments(pairs, times=None, rejected=(), length=SEGMENT_PAIRS, profile='realtime'):
    """Return the float32 (R, C) of each DisparityImage, as a matcher finds them by itself."""
    times, found = times or stamps(len(pairs)), []
    for begin in range(0, len(pairs), length):
        matcher = StereoMatcher(MatcherConfig.from_profile(profile, disparities=DISPARITIES))
        for number in range(max(begin - WARM_PAIRS, 0), min(begin + length, len(pairs))):
            if number and times[number] < times[number - 1]:
                matcher.reset()
            if number in rejected:
                continue
            match = matcher.match(pairs[number].left, pairs[number].right, times[number])
            if number >= begin:
                found.append(np.where(np.isnan(match.disparity), -1,
                                      np.maximum(match.disparity, 0)))
    return found


def written(path):
    """Return the float32 (R, C) of each DisparityImage of a bag."""
    return [values_of(message.image) for _, _, message in content(path, '/disparity')]


def assert_same(found, expected):
    """Compare two lists of arrays bit for bit."""
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_array_equal(one, other)


def test_a_cluster_finds_what_a_matcher_finds_in_segments(
        folder, capsys, cluster):
    pairs = scene(PAIRS)
    write_bag(folder / 'bag', pairs=pairs)
    expected = in_segments(pairs)
    assert not np.array_equal(expected[SEGMENT_PAIRS],
                              in_segments(pairs, length=PAIRS)[SEGMENT_PAIRS])
    found = figures(capsys, 'bag', options=['--scheduler', cluster.address])
    assert_same(written(folder / 'out'), expected)
    assert list(disparities(folder / 'out')) == stamps(PAIRS)
    assert found['segments'] == {'matched': 3, 'pairs': SEGMENT_PAIRS, 'workers': 2}
    assert (found['pairs']['matched'], found['pairs']['matched_again']) == (PAIRS, 2 * WARM_PAIRS)
    assert found['pairs']['warm'] == PAIRS + 2 * WARM_PAIRS - 3
    assert 0 < found['share_not_matching'] < 1
    assert replay('bag', output='told', options=['--scheduler', cluster.address]) == 0
    assert f'{PAIRS} pairs matched, in 3 segments on 2 workers, {2 * WARM_PAIRS} matched ' \
        'again to warm up' in capsys.readouterr().out


@pytest.mark.parametrize('profile', ['realtime', 'quality'])
def test_the_frames_of_folders_are_matched_in_segments_too(folder, capsys, profile):
    pairs = scene(SEGMENT_PAIRS + 4)
    for side in ('left', 'right'):
        (folder / side).mkdir()
        for number, pair in enumerate(pairs):
            write_image(folder / side / f'{number:02}.png', getattr(pair, side))
    times = [number * 10**8 for number in range(len(pairs))]
    expected = in_segments(pairs, times, profile=profile)
    whole = in_segments(pairs, times, length=len(pairs), profile=profile)
    assert not np.array_equal(expected[-1], whole[-1])
    found = figures(capsys, 'left', 'right', options=['--profile', profile, '--workers', 2])
    assert found['segments'] == {'matched': 2, 'pairs': SEGMENT_PAIRS, 'workers': 2}
    assert_same(written(folder / 'out'), expected)


def test_bad_pairs_and_stamps_that_go_back_are_as_without_workers(folder, capsys, cluster):
    narrow, nonsense, back = SEGMENT_PAIRS - 4, SEGMENT_PAIRS - 2, SEGMENT_PAIRS + 10
    pairs = scene(SEGMENT_PAIRS + 20)
    times = [BEGIN + (number - back * (number >= back)) * STEP for number in range(len(pairs))]

    def spoil(number, messages):
        for topic, message in messages.items():
            message.header.stamp.sec, message.header.stamp.nanosec = divmod(times[number], 10**9)
            if number == narrow and topic in TOPICS[::2]:
                message.width = DISPARITIES - 4
        if number == nonsense:
            messages[TOPICS[0]].encoding = 'nonsense'

    write_bag(folder / 'bag', pairs=pairs, change=spoil)
    plain = figures(capsys, 'bag', output='plain')
    found = figures(capsys, 'bag', options=['--scheduler', cluster.address])
    assert found['pairs']['rejected'] == plain['pairs']['rejected'] == {'encoding': 1, 'match': 1}
    assert found['remarks'] == plain['remarks']
    assert found['pairs']['matched'] == len(pairs) - 2
    assert found['pairs']['matched_again'] == WARM_PAIRS - 2
    assert_same(written(folder / 'out'), in_segments(pairs, times, (narrow, nonsense)))
    assert replay('bag', output='told', options=['--scheduler', cluster.address]) == 0
    told = capsys.readouterr().err
    assert 'timestamps jumped back; matcher reset' in told
    assert f'pair {times[narrow] / 1e9:.3f} rejected: ' in told
    assert f'pair {times[nonsense] / 1e9:.3f} rejected: left image: encoding is' in told


def test_selected_pairs_and_copies_are_the_same_as_without_workers(folder, cluster):
    def more(bag, number, log_time):
        for part in range(2):
            bag.write('/chatter', bag.make('std_msgs/msg/Int32', data=2 * number + part),
                      log_time + part)

    write_bag(folder / 'bag', pairs=scene(PAIRS), more=more)
    options = ['--every', 2, '--start', 2 * STEP / 1e9, '--keep', '/chatter', TOPICS[0],
               '--with', 'points2', 'confidence', 'depth']
    assert replay('bag', output='plain', options=options) == 0
    assert replay('bag', options=[*options, '--scheduler', cluster.address]) == 0
    found, plain = (content(folder / name) for name in ('out', 'plain'))
    assert [one[:2] for one in found] == [one[:2] for one in plain]
    assert_same(written(folder / 'out'), in_segments(
        scene(PAIRS)[2::2], stamps(PAIRS)[2::2]))


def test_a_worker_that_is_killed_loses_nothing(folder, capfd, cluster):
    pairs = scene(5 * SEGMENT_PAIRS)
    write_bag(folder / 'bag', pairs=pairs)
    process, address = cluster.worker(HALTING)
    with ThreadPoolExecutor(1) as killing:
        killed = killing.submit(lambda: (process.stdout.readline(), process.kill()))
        found = figures(capfd, 'bag', options=['--scheduler', cluster.address])
        assert killed.result()[0] == b'in the middle\n'
    assert process.wait() == -signal.SIGKILL
    assert found['pairs']['matched'] == len(pairs)
    assert found['segments'] == {'matched': 5, 'pairs': SEGMENT_PAIRS, 'workers': 3}
    assert_same(written(folder / 'out'), in_segments(pairs))
