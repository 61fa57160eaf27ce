# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The real node warns where its calibration does not hold or it is all but blind, and says why."""
from bench.conditions import misaligned
from diagnostic_msgs.msg import DiagnosticStatus
from fuzzy_stereo_ros.synthetic.scenes import make_pair
import numpy as np
import pytest

PAIR = make_pair(240, 320, 32, seed=2, objects=6, noise=2.0)[:2]
WALL, BLACK = (2 * (np.full((240, 320), level, np.uint8),) for level in (90, 2))
SWAPPED = 'left and right are swapped: '


@pytest.fixture(scope='module')
def bench(make_bench):
    """Return a node that has matched a pair whose rows fit."""
    with make_bench('--ros-args', '-p', 'disparity_range:=32') as bench:
        bench.begin(*PAIR)
        yield bench


def status_when(bench, condition, pair, change=None):
    """Match a pair until the status of diagnostics fulfils a condition; return the status."""
    def told():
        for _ in range(10):
            bench.match(*pair, change=change)
        bench.counts_now()
        return condition(bench.status)

    bench.until(told, 'the condition')
    return bench.status


def warns(status):
    return status.level == DiagnosticStatus.WARN


def is_ok(status):
    return status.level == DiagnosticStatus.OK


def test_a_pair_that_fits_is_no_reason_to_warn_and_its_figures_are_told(bench):
    status = status_when(bench, lambda _: 'row offset, tilt' in bench.counts_now(), PAIR)
    values = bench.counts_now()
    assert status.level == DiagnosticStatus.OK
    assert 'recalibrate' not in status.message
    assert abs(float(values['row offset, tilt'].split()[0])) < 0.1
    assert {'row offset, roll', 'row offset, zoom', 'row offset, yaw', 'row offset, swing',
            'row offset, measured', 'row offset, undone'} <= set(values)


def test_a_camera_that_is_turned_is_warned_of_with_what_to_do_until_it_is_calibrated(bench):
    def moved(messages):
        messages['left/camera_info'].p[2] += 1.0        # another calibration, so that it forgets
        messages['right/camera_info'].p[2] += 1.0

    turned = PAIR[0], misaligned(PAIR[1], roll=0.5)
    assert 'recalibrate: the right camera is turned by +0.' in status_when(
        bench, warns, turned, moved).message
    bench.node.logged('recalibrate: the right camera is turned by +0.')
    assert bench.node.log().count('recalibrate') == 1
    assert 'recalibrate' not in status_when(bench, is_ok, PAIR).message


def test_remarks_on_the_cameras_are_in_the_log_once_and_in_the_status_until_they_are_mended(bench):
    def in_millimetres(messages):
        messages['right/camera_info'].p[3] *= 1000

    status = status_when(bench, warns, PAIR, in_millimetres)
    remark = 'the baseline is 120 m; if that is meant to be cm or mm'
    assert f'; {remark}' in status.message
    assert bench.counts_now()['calibration'].startswith(remark)
    bench.node.logged(remark)
    assert bench.node.log().count(remark) == 1
    status_when(bench, is_ok, PAIR)
    assert bench.counts_now()['calibration'] == 'OK'


def test_swapped_and_black_images_are_warned_of_once_each_time_and_a_wall_is_not(bench):
    assert '; ' not in status_when(bench, is_ok, PAIR).message
    for times in (1, 2):
        assert SWAPPED in status_when(bench, warns, PAIR[::-1]).message
        status_when(bench, warns, PAIR[::-1])
        assert bench.node.log().count(SWAPPED) == times
        status_when(bench, is_ok, PAIR)
    assert 'black' in status_when(bench, warns, BLACK).message
    bench.node.logged('the left and right images are black (brightness 2 of 255): uncover')
    status_when(bench, is_ok, PAIR)
    status = status_when(bench, lambda status: 'texture' in status.message, WALL)
    assert is_ok(status)
    assert ('suspected fault', 'plain') in {(one.key, one.value) for one in status.values}
    assert 'little texture' not in bench.node.log()
