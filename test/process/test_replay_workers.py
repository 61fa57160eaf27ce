# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""`fuzzy-stereo replay` on workers: always the same segments, whoever matches them and dies."""
from concurrent.futures import ThreadPoolExecutor
import json
from shutil import rmtree
import signal

from dask_processes import dask_processes
from fuzzed import examples
from fuzzy_stereo_ros.replay.options import SEGMENT_PAIRS, WARM_PAIRS
from hypothesis import given, settings, strategies as st
from made_bags import (
    BEGIN, content, DISPARITIES, disparities, scene, stamps, STEP, TOPICS, write_bag)
import numpy as np
import pytest
from replayed import assert_same, chatter, figures, in_segments, replay, restamp, sent
from written_scenes import write_images

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


def test_a_cluster_finds_what_a_matcher_finds_in_segments(
        folder, capsys, cluster):
    pairs = scene(PAIRS)
    write_bag(folder / 'bag', pairs=pairs)
    expected = in_segments(pairs)
    assert not np.array_equal(expected[SEGMENT_PAIRS],
                              in_segments(pairs, length=PAIRS)[SEGMENT_PAIRS])
    found = figures(capsys, 'bag', options=['--scheduler', cluster.address])
    assert_same(sent(folder / 'out'), expected)
    assert list(disparities(folder / 'out')) == stamps(PAIRS)
    assert found['segments'] == {'matched': 3, 'pairs': SEGMENT_PAIRS, 'workers': 2}
    assert (found['pairs']['matched'], found['pairs']['matched_again']) == (PAIRS, 2 * WARM_PAIRS)
    assert found['pairs']['warm'] == PAIRS + 2 * WARM_PAIRS - 3
    assert 0 < found['share_not_matching'] < 1
    assert replay('bag', output='told', options=['--scheduler', cluster.address]) == 0
    assert f'{PAIRS} pairs matched, in 3 segments on 2 workers, {2 * WARM_PAIRS} matched ' \
        'again to warm up' in capsys.readouterr().out


def test_the_frames_of_folders_are_matched_in_segments_too_of_any_profile(
        folder, capsys, cluster):
    pairs, profile = scene(SEGMENT_PAIRS + 4, rows=20, columns=48), 'quality'
    for number, pair in enumerate(pairs):
        write_images(folder, pair, f'left/{number:02}.png', f'right/{number:02}.png')
    times = [number * 10**8 for number in range(len(pairs))]
    expected = in_segments(pairs, times, profile=profile)
    whole = in_segments(pairs, times, length=len(pairs), profile=profile)
    assert not np.array_equal(expected[-1], whole[-1])
    found = figures(capsys, 'left', 'right', options=[
        '--profile', profile, '--scheduler', cluster.address])
    assert found['segments'] == {'matched': 2, 'pairs': SEGMENT_PAIRS, 'workers': 2}
    assert_same(sent(folder / 'out'), expected)


@settings(examples(3), deadline=None)
@given(start=st.integers(0, 3), every=st.integers(1, 3), back=st.integers(8, PAIRS - 1),
       bad=st.sets(st.integers(0, PAIRS - 1), min_size=1, max_size=8))
def test_bad_pairs_jumps_back_copies_and_selected_pairs_are_as_without_workers(
        folder, capsys, cluster, start, every, back, bad):
    pairs = scene(PAIRS)
    times = [BEGIN + (number - back * (number >= back)) * STEP for number in range(PAIRS)]

    def spoil(number, messages):
        restamp(messages, times[number])
        if number in bad and number % 2:
            messages[TOPICS[0]].encoding = 'nonsense'
        elif number in bad:
            for topic in TOPICS[::2]:
                messages[topic].width = DISPARITIES - 4

    rmtree('bag', ignore_errors=True)
    write_bag(folder / 'bag', pairs=pairs, change=spoil, more=chatter)
    options = ['--every', every, '--start', start * STEP / 1e9, '--keep', '/chatter', TOPICS[0],
               '--with', 'points2', 'confidence', 'depth', '--overwrite']
    plain = figures(capsys, 'bag', output='plain', options=options)
    assert replay('bag', options=[*options, '--scheduler', cluster.address, '--json']) == 0
    printed = capsys.readouterr()
    found = json.loads(printed.out)
    chosen = range(start, PAIRS, every)
    lost = [place for place, number in enumerate(chosen) if number in bad]
    assert found['pairs']['matched'] == len(chosen) - len(lost)
    assert found['pairs']['rejected'] == plain['pairs']['rejected']
    assert found['remarks'] == plain['remarks']
    for place in lost[:1]:
        assert f'pair {times[chosen[place]] / 1e9:.3f} rejected: ' in printed.err
    assert 'timestamps jumped back; matcher reset' in printed.err
    out, without = (content(folder / name) for name in ('out', 'plain'))
    assert [one[:2] for one in out] == [one[:2] for one in without]
    assert_same(sent(folder / 'out'), in_segments(
        pairs[start::every], times[start::every], lost))


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
    assert_same(sent(folder / 'out'), in_segments(pairs))
