# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the node says about itself: status, figures, lines about losses."""
from collections import Counter
from dataclasses import replace
import re
from types import SimpleNamespace

from fuzzy_stereo_ros.matching.plausibility import Finding
from fuzzy_stereo_ros.pairs.stereo_pair import UNCALIBRATED
from hypothesis import given, strategies
import numpy as np
import pytest

diagnostics = pytest.importorskip('fuzzy_stereo_ros.node.diagnostics')
LossReports = diagnostics.LossReports
Time = pytest.importorskip('builtin_interfaces.msg').Time
KEYS = 'pairs dropped', 'unmatched left/image_rect', 'unmatched right/camera_info'
NODE = SimpleNamespace(create_publisher=lambda *_: None)


def matched(times=None, reused=False, disparity=(1.0,), confidence=(1.0,), misalignment=None,
            generations=0, motion=''):
    return SimpleNamespace(
        times=times or {}, generations=generations, warm=True, motion=motion, reused=reused,
        disparity=np.float32([disparity]), confidence=np.float32([confidence]),
        misalignment=misalignment)


def test_rates_count_per_second_since_the_call_before():
    made = diagnostics.Diagnostics(NODE, 10.0)
    assert made.rates(12.0, {'pairs': 6}) == {'pairs': 3.0}
    assert made.rates(16.0, {'pairs': 6}) == {'pairs': 0.0}


def test_figures_tell_the_times_and_what_the_newest_match_was_like():
    made = diagnostics.Diagnostics(NODE, 0.0)
    assert made.figures() == {}
    for milliseconds in (10.0, 20.0, 30.0):
        made.matched(matched({'total': milliseconds / 2}, False, (1, np.nan), (0.5, 0.0),
                             generations=2, motion='followed'), latency=milliseconds)
    made.reject('size')
    assert made.figures() == {
        'rejected: size': '1', 'latency, last': '30.0 ms', 'latency, median': '20.0 ms',
        'latency, 95th percentile': '29.0 ms', 'matching time, last': '15.0 ms',
        'matching time, median': '10.0 ms', 'matching time, 95th percentile': '14.5 ms',
        'generations': '2', 'warm start': 'true', 'result reused (static scene)': 'false',
        'camera motion': 'followed',
        'mean confidence': '0.250', 'valid share': '0.500'}


def test_stages_that_the_newest_pair_skipped_keep_their_figures():
    made = diagnostics.Diagnostics(NODE, 0.0)
    for times in ({'search': 8.0, 'total': 10.0}, {'total': 2.0}):
        made.matched(matched(times, 'search' not in times))
    figures = made.figures()
    assert figures['time of search, last'] == figures['time of search, median'] == '8.0 ms'
    assert figures['matching time, last'] == '2.0 ms'


@pytest.mark.parametrize('loading, idle, silence, rates, expected', [
    ('loading the kernels', 'idle', 0, {}, ('STALE', 'loading the kernels')),
    ('compiling the kernels: 40 %, about 12 s left', '', 9, {}, (
        'STALE', 'compiling the kernels: 40 %, about 12 s left')),
    ('', 'idle: not activated', 0, {}, ('OK', 'idle: not activated')),
    ('', '', 6.2, {}, ('ERROR', 'no stereo pair for 6 s')),
    ('', '', 0, {'rejected': 2}, ('WARN', 'rejecting 2.0 pairs/s')),
    ('', '', 0, {'rejected': 2, 'matched': 0}, ('ERROR', 'rejecting 2.0 pairs/s')),
    ('', '', 0, {'dropped': 9.4}, ('OK', 'matching 9.5 pairs/s')),
    ('', '', 0, {'dropped': 20.5}, (
        'WARN', 'matching 9.5 pairs/s and dropping 20.5: they come faster than they can be '
        'matched; see scale and disparity_range')),
])
def test_the_status_is_the_worst_that_is_true(loading, idle, silence, rates, expected):
    rates = {f'pairs {how}': {'rejected': 0, 'dropped': 0, 'matched': 9.5, **rates}[how]
             for how in ('rejected', 'dropped', 'matched')}
    assert diagnostics.status_of(loading, idle, silence, rates) == expected


MISALIGNED = SimpleNamespace(advice='recalibrate: roll', figures={'row offset, tilt': '+0.10 px'})


def published_by(misalignment, finding, idle='', silence=0, calibration=UNCALIBRATED):
    """Return the Diagnostics, the level and the sentence that it publishes."""
    published = []
    made = diagnostics.Diagnostics(SimpleNamespace(
        create_publisher=lambda *_: SimpleNamespace(publish=published.append),
        get_fully_qualified_name=lambda: '/node',
        get_clock=lambda: SimpleNamespace(now=lambda: SimpleNamespace(to_msg=Time))), 0.0)
    counts = dict.fromkeys(['pairs synchronised', 'pairs matched', 'pairs dropped',
                            'pairs rejected'], 0)
    made.matched(matched(misalignment=misalignment))
    made.calibration = calibration
    made.publish(1.0, counts, {}, '', idle, silence, finding)
    first, second = published[0].status
    assert (second.level, second.name) == (
        diagnostics.DiagnosticStatus.OK, f'{first.name}, details')
    told = [[value.key for value in status.values] for status in (first, second)]
    assert told[0] == [key for key in diagnostics.AT_A_GLANCE if key in made.values]
    assert sorted(sum(told, [])) == sorted(made.values)
    return made, first.level, first.message


@pytest.mark.parametrize('idle, silence, level, sentence', [
    ('', 0, 'WARN', 'matching 0.0 pairs/s; recalibrate: roll'),
    ('', 6, 'ERROR', 'no stereo pair for 6 s; recalibrate: roll'),
    ('idle: not activated', 0, 'OK', 'idle: not activated')])
def test_a_misalignment_raises_the_level_where_it_is_ok_and_stands_behind_what_is_worse(
        idle, silence, level, sentence):
    made, *told = published_by(MISALIGNED, None, idle, silence)
    assert told == [getattr(diagnostics.DiagnosticStatus, level), sentence]
    assert made.values['row offset, tilt'] == '+0.10 px'
    assert made.values['rectification'] == 'recalibrate: roll'
    assert made.values['suspected fault'] == 'none'


@pytest.mark.parametrize('warns, idle, level, sentence', [
    (True, '', 'WARN', 'matching 0.0 pairs/s; left and right are swapped'),
    (False, '', 'OK', 'matching 0.0 pairs/s; left and right are swapped'),
    (True, 'idle: not activated', 'OK', 'idle: not activated')])
def test_a_finding_that_warns_raises_the_level_and_another_is_told_alone(
        warns, idle, level, sentence):
    made, *told = published_by(
        None, Finding('swapped', 'left and right are swapped', warns), idle)
    assert told == [getattr(diagnostics.DiagnosticStatus, level), sentence]
    assert made.values['suspected fault'] == 'swapped'
    assert made.values['row offset, measured'].startswith('not measured: too few points')


@pytest.mark.parametrize('baseline, remarks, level, sentence', [
    (0.1, (), 'OK', ''), (7.5, ('it is cm', 'cx is far'), 'WARN', '; it is cm; cx is far'),
    (0.0, ('the baseline is 0 m',), 'OK', '; the baseline is 0 m')])
def test_remarks_on_the_cameras_are_told_and_warn_where_metres_may_be_wrong(
        baseline, remarks, level, sentence):
    cameras = replace(UNCALIBRATED, baseline=baseline, remarks=remarks)
    made, *told = published_by(None, None, calibration=cameras)
    assert told == [getattr(diagnostics.DiagnosticStatus, level),
                    f'matching 0.0 pairs/s{sentence}']
    assert made.values['calibration'] == ('; '.join(remarks) or 'OK')


def reported(lines):
    """Return a Counter of the numbers in lines."""
    found = Counter()
    for line in lines:
        for number, key in re.findall(rf"(\d+) ({'|'.join(KEYS)})", line):
            found[key] += int(number)
    return found


def test_the_first_loss_is_reported_at_once_then_one_line_a_period_with_what_came_since():
    losses = LossReports(period=60.0)
    assert losses.lines(10.0, {'pairs dropped': 0, 'pairs matched': 9}) == []
    assert losses.lines(11.0, {'pairs dropped': 2}) == [
        '2 pairs dropped since the last report (newer pairs came first; see scale and '
        'disparity_range)']
    assert losses.lines(70.9, {'pairs dropped': 7}) == []
    assert reported(losses.lines(71.0, {'pairs dropped': 8})) == {'pairs dropped': 6}
    assert losses.lines(200.0, {'pairs dropped': 8}) == []


def test_one_kind_does_not_hold_back_another_and_topics_share_a_line():
    losses = LossReports()
    losses.lines(0.0, {'pairs dropped': 1})
    line, = losses.lines(1.0, {'pairs dropped': 2, 'unmatched left/image_rect': 3,
                               'unmatched right/camera_info': 4})
    assert line.startswith('3 unmatched left/image_rect, 4 unmatched right/camera_info since the '
                           'last report (no messages of the same stamp ')


@given(strategies.lists(strategies.tuples(
    strategies.floats(0, 100), strategies.sampled_from(KEYS), strategies.integers(0, 9))))
def test_the_numbers_of_all_lines_add_up_to_the_counts(steps):
    losses, now, counts, lines = LossReports(), 0.0, Counter(dict.fromkeys(KEYS, 0)), []
    for seconds, key, number in steps:
        now += seconds
        counts[key] += number
        lines += losses.lines(now, counts)
    lines += losses.lines(now, counts, last=True)
    assert reported(lines) == +counts
