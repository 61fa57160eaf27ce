# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The command `replay` run on small bags, here or in a process, and what it should find."""
import json
import os
import subprocess
import sys

from fuzzy_stereo_ros.commands.command_line import main
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.replay.options import SEGMENT_PAIRS, WARM_PAIRS
from made_bags import content, DISPARITIES, stamps
from made_messages import values_of
import numpy as np
from repository import ROOT

INTERRUPTED = 130


def replay(*bags, output='out', disparities=DISPARITIES, options=()):
    """Run `fuzzy-stereo replay` and return its exit code."""
    return main(['replay', *map(str, bags), '--output', str(output), '--disparities',
                 str(disparities), *map(str, options)])


def figures(capsys, *bags, code=0, **options):
    """Run it with --json and return what it printed."""
    options['options'] = (*options.get('options', ()), '--json')
    capsys.readouterr()
    assert replay(*bags, **options) == code, capsys.readouterr().err
    return json.loads(capsys.readouterr().out)


def rejection(capsys, *bags, **options):
    """Run it in vain and return the one sentence it ends with."""
    capsys.readouterr()
    assert replay(*bags, **options) == 2
    printed = capsys.readouterr()
    assert 'Traceback' not in printed.err
    return printed.err.splitlines()[-1].removeprefix('fuzzy-stereo: ')


def run(code, number, *arguments):
    """Run `fuzzy-stereo replay` in a process and a group of its own, restricted by a number."""
    return subprocess.run(
        [sys.executable, '-c', code, str(number), 'replay', *map(str, arguments), '--output',
         'out', '--disparities', '16'], capture_output=True, text=True, start_new_session=True,
        env={**os.environ, 'PYTHONPATH': str(ROOT)})


def matches(pairs, stamps, disparities=DISPARITIES, camera=None, profile='realtime', **changes):
    """Return the Match of each pair: matched one after the other, without replay."""
    matcher, before, found = StereoMatcher(MatcherConfig.from_profile(
        profile, disparities=disparities, **changes)), 0, []
    for pair, stamp in zip(pairs, stamps):
        if stamp < before:
            matcher.reset()
        found.append(matcher.match(pair.left, pair.right, stamp=stamp, camera=camera))
        before = stamp
    return found


def as_sent(found):
    """Return the disparities of matches, float32 (R, C), as DisparityImages have them."""
    return [np.where(np.isnan(match.disparity), -1, np.maximum(match.disparity, 0))
            for match in found]


def in_segments(pairs, times=None, rejected=(), length=SEGMENT_PAIRS, profile='realtime'):
    """Return the float32 (R, C) of each DisparityImage, as a matcher finds them by itself."""
    times, found = times or stamps(len(pairs)), []
    for begin in range(0, len(pairs), length):
        numbers = [number for number in range(
            max(begin - WARM_PAIRS, 0), min(begin + length, len(pairs))) if number not in rejected]
        found += as_sent(matches([pairs[number] for number in numbers], [
            times[number] for number in numbers], profile=profile))[
                sum(number < begin for number in numbers):]
    return found


def sent(path):
    """Return the disparities of the DisparityImages of a bag, float32 (R, C)."""
    return [values_of(message.image) for _, _, message in content(path, '/disparity')]


def assert_same(found, expected):
    """Compare two lists of arrays bit for bit."""
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_array_equal(one, other)


def restamp(messages, stamp):
    """Give the messages of a pair a stamp, ns."""
    for message in messages.values():
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, 10**9)


def chatter(bag, number, log_time):
    """Write what may be copied: two messages before each pair."""
    for part in range(2):
        bag.write('/chatter', bag.make('std_msgs/msg/Int32', data=2 * number + part),
                  log_time + part)
