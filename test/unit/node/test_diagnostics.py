# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the node says about itself: status, figures, lines about losses."""
from collections import Counter
from dataclasses import replace
import re
from types import SimpleNamespace

from fuzzy_stereo_ros.matching.plausibility import Finding
from fuzzy_stereo_ros.matching.row_offsets import Misalignment
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


def test_figures_tell_the_times_and_what_the_newest_match_was_like():
    made = diagnostics.Diagnostics(NODE, 0.0)
    assert made.figures() == {}
    for milliseconds, searching in ((10.0, 8.0), (20.0, None), (30.0, None)):
        made.matched(matched({'total': milliseconds / 2, **(
            {'search': searching} if searching else {})}, not searching, (1, np.nan), (0.5, 0.0),
            generations=2, motion='followed'), latency=milliseconds)
    made.reject('size', 'the images differ in size')
    assert made.figures() == {
        'rejected: size': '1', 'latency, last': '30.0 ms', 'latency, median': '20.0 ms',
        'latency, 95th percentile': '29.0 ms', 'matching time, last': '15.0 ms',
        'matching time, median': '10.0 ms', 'matching time, 95th percentile': '14.5 ms',
        'time of search, last': '8.0 ms', 'time of search, median': '8.0 ms',
        'time of search, 95th percentile': '8.0 ms',    # the newest pairs skipped this stage
        'generations': '2', 'warm start': 'true', 'result reused (static scene)': 'true',
        'camera motion': 'followed',
        'mean confidence': '0.250', 'valid share': '0.500'}


@pytest.mark.parametrize('loading, idle, silence, rates, expected', [
    ('loading the kernels', 'idle', 0, {}, ('STALE', 'loading the kernels')),
    ('compiling the kernels: 40 %, about 12 s left', '', 9, {}, (
        'STALE', 'compiling the kernels: 40 %, about 12 s left')),
    ('', 'idle: not activated', 0, {}, ('OK', 'idle: not activated')),
    ('', '', 6.2, {}, ('ERROR', 'no stereo pair for 6 s')),
    ('', '', 0, {'rejected': 2}, ('WARN', 'rejecting 2.0 pairs/s: P is empty')),
    ('', '', 0, {'rejected': 2, 'matched': 0}, ('ERROR', 'rejecting 2.0 pairs/s: P is empty')),
    ('', '', 0, {'dropped': 9.4}, ('OK', 'matching 9.5 pairs/s')),
    ('', '', 0, {'dropped': 20.5}, (
        'WARN', 'matching 9.5 pairs/s and dropping 20.5: they come faster than they can be '
        'matched; see scale and disparity_range')),
    ('', '', 0, {'dropped': 20.5, 'preparing': 1}, (
        'OK', 'matching 9.5 pairs/s and dropping 20.5 while changed parameters are being '
        'prepared')),
])
def test_the_status_is_the_worst_that_is_true(loading, idle, silence, rates, expected):
    rates = {**rates, **{
        f'pairs {how}': {'rejected': 0, 'dropped': 0, 'matched': 9.5, **rates}[how]
        for how in ('rejected', 'dropped', 'matched')}}
    preparing = bool(rates.pop('preparing', False))
    assert diagnostics.status_of(
        diagnostics.State(loading, idle, silence, preparing), rates, 'P is empty') == expected


ROWS = Misalignment(0.1, 0.9, 0.0, 0.0, (0.01,) * 4, 0.1, 500, 16, 240, 320, undone=True)
SWAPPED = Finding('swapped', 'left and right are swapped')
APART = Finding('rows', 'the rows of the images do not fit')
PLAIN = Finding('plain', 'little texture', warns=False)


def publisher():
    """Return Diagnostics without ROS, and the list of what they publish."""
    published = []
    return diagnostics.Diagnostics(SimpleNamespace(
        create_publisher=lambda *_: SimpleNamespace(publish=published.append),
        get_fully_qualified_name=lambda: '/node',
        get_clock=lambda: SimpleNamespace(now=lambda: SimpleNamespace(to_msg=Time))), 0.0
    ), published


def told(made, published, idle='', silence=0, **options):
    """Return the level and the sentence that Diagnostics publish."""
    made.publish(1.0, dict.fromkeys(
        ['pairs synchronised', 'pairs matched', 'pairs dropped', 'pairs rejected'], 0), {},
        diagnostics.State('', idle, silence), **options)
    first, second = published[-1].status
    assert (second.level, second.name) == (
        diagnostics.DiagnosticStatus.OK, f'{first.name}, details')
    keys = [[value.key for value in status.values] for status in (first, second)]
    assert keys[0] == [key for key in diagnostics.AT_A_GLANCE if key in made.values]
    assert sorted(sum(keys, [])) == sorted(made.values)
    levels = {getattr(diagnostics.DiagnosticStatus, level): level
              for level in ('OK', 'WARN', 'ERROR')}
    return levels[first.level], first.message


@pytest.mark.parametrize('idle, silence, level, sentence', [
    ('', 0, None, 'matching 0.0 pairs/s'),
    ('', 6, 'ERROR', 'no stereo pair for 6 s'),
    ('idle: not activated', 0, 'OK', 'idle: not activated')])
@pytest.mark.parametrize('finding, rows, remark, rectification', [
    (None, ROWS, '', ROWS.advice), (None, ROWS._replace(roll=0.1), '', 'OK'),
    (None, ROWS._replace(undone=False), None, None),
    (SWAPPED, ROWS._replace(swing=0.9), SWAPPED.sentence, ROWS._replace(swing=0.9).advice),
    (SWAPPED, None, SWAPPED.sentence, 'not measured: too few points are found in both images'),
    (APART, ROWS, APART.sentence, APART.sentence), (PLAIN, ROWS, PLAIN.sentence, ROWS.advice)])
def test_what_is_wrong_with_the_pairs_is_told_while_pairs_come_and_what_is_undone_is_a_value(
        idle, silence, level, sentence, finding, rows, remark, rectification):
    made, published = publisher()
    made.matched(matched(misalignment=rows))
    remark = rows.advice if remark is None else remark
    if level is None:
        level = 'WARN' if remark not in ('', PLAIN.sentence) else 'OK'
        sentence += f'; {remark}' * bool(remark)
    assert told(made, published, idle, silence, finding=finding) == (level, sentence)
    assert made.values['rectification'] == (rectification or rows.advice)
    assert made.values['suspected fault'] == (finding.cause if finding else 'none')
    assert made.values['row offset, measured']
    assert rows is None or made.values['row offset, tilt'] == '+0.10 +- 0.01 px'


def test_rows_that_move_are_a_reason_to_warn_until_the_rig_is_calibrated_anew():
    made, published = publisher()

    def after(rows, **options):
        made.matched(matched(misalignment=rows))
        return told(made, published, **options)

    assert after(ROWS)[0] == 'OK'
    assert after(ROWS._replace(tilt=0.3))[0] == 'OK'
    level, sentence = after(ROWS._replace(tilt=1.4, pairs=3))
    assert (level, sentence.split('; ', 1)[1]) == (
        'WARN', 'recalibrate: the rows have moved by 1.3 px since the start, as by a knock or '
        'heat; undone before matching')
    assert made.values['rectification'] in sentence
    made.calibration = replace(made.calibration, focal=401.0)
    assert after(ROWS._replace(tilt=-1.4))[0] == 'OK'
    # What is measured while pairs do not belong together is not what the rig was at the start.
    made.calibration = replace(made.calibration, focal=402.0)
    after(ROWS._replace(tilt=-7.0), finding=SWAPPED)
    assert after(ROWS)[0] == 'OK'


@pytest.mark.parametrize('baseline, remarks, level, sentence', [
    (0.1, (), 'OK', ''), (7.5, ('it is cm', 'cx is far'), 'WARN', '; it is cm; cx is far'),
    (0.0, ('the baseline is 0 m',), 'OK', '; the baseline is 0 m')])
def test_remarks_on_the_cameras_are_told_and_warn_where_metres_may_be_wrong(
        baseline, remarks, level, sentence):
    cameras = replace(UNCALIBRATED, baseline=baseline, remarks=remarks)
    made, published = publisher()
    made.matched(matched())
    made.calibration = cameras
    assert told(made, published) == (level, f'matching 0.0 pairs/s{sentence}')
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
        '2 pairs dropped since the last report (newer pairs came first, or parameters were '
        'prepared; see scale and disparity_range)']
    assert losses.lines(70.9, {'pairs dropped': 7}) == []
    assert reported(losses.lines(71.0, {'pairs dropped': 8})) == {'pairs dropped': 6}
    assert losses.lines(200.0, {'pairs dropped': 8}) == []


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
