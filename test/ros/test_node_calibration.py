# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The real node says when its calibration does not hold, and of what kind the error is."""
from bench.conditions import misaligned
from diagnostic_msgs.msg import DiagnosticStatus
from fuzzy_stereo_ros.synthetic.scenes import make_pair
import pytest

PAIR = make_pair(240, 320, 32, seed=2, objects=6, noise=2.0)


@pytest.fixture(scope='module')
def bench(make_bench):
    """Return a node that has matched a pair whose rows fit."""
    with make_bench('--ros-args', '-p', 'disparity_range:=32') as bench:
        bench.begin(PAIR.left, PAIR.right)
        yield bench


def status_when(bench, condition, pair):
    """Match a pair until the values of diagnostics fulfil a condition; return the status."""
    def told():
        for _ in range(30):
            bench.match(*pair)
        return condition(bench.counts_now())

    bench.until(told, 'the condition')
    return bench.status


def test_a_pair_that_fits_is_no_reason_to_warn_and_its_figures_are_told(bench):
    status = status_when(bench, lambda values: 'row offset, tilt' in values,
                         (PAIR.left, PAIR.right))
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

    turned = misaligned(PAIR.right, roll=0.5)

    def warned():
        for _ in range(30):
            bench.match(PAIR.left, turned, change=moved)
        bench.counts_now()
        return bench.status.level == DiagnosticStatus.WARN

    bench.until(warned, 'a warning')
    assert 'recalibrate: the right camera is turned by +0.' in bench.status.message
    bench.node.logged('recalibrate: the right camera is turned by +0.')
    assert bench.node.log().count('recalibrate') == 1
    status = status_when(bench, lambda values: bench.status.level == DiagnosticStatus.OK,
                         (PAIR.left, PAIR.right))
    assert 'recalibrate' not in status.message
