# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The real node warns where its calibration does not hold or it is all but blind, and says why."""
import re

from bench.conditions import misaligned
from diagnostic_msgs.msg import DiagnosticStatus
from fuzzy_stereo_ros.synthetic.scenes import make_pair
import numpy as np

PAIR = make_pair(240, 320, 32, seed=2, objects=6, noise=2.0)[:2]
WALL, BLACK = (2 * (np.full((240, 320), level, np.uint8),) for level in (90, 2))
ARGUMENTS = '-p', 'disparity_range:=32'
SWAPPED = 'left and right are swapped: '


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


def test_a_camera_that_turns_is_warned_of_with_what_to_do_until_it_is_calibrated(bench):
    def measured(status):
        return int(bench.counts_now()['row offset, measured'].split()[3]) >= 8

    def moved(messages):
        messages['left/camera_info'].p[2] += 1.0        # another calibration, so that it forgets
        messages['right/camera_info'].p[2] += 1.0

    assert is_ok(status_when(bench, measured, PAIR))
    turned = PAIR[0], misaligned(PAIR[1], roll=0.5)
    told = 'recalibrate: the rows have moved by '
    assert told in status_when(bench, lambda status: told in status.message, turned).message
    bench.node.logged(told)
    status = status_when(bench, is_ok, turned, moved)
    assert bench.node.log().count('recalibrate') == 1
    values = {one.key: one.value for one in status.values}
    assert values['rectification'].startswith('recalibrate: the right camera is turned by +0.')
    assert values['rectification'].endswith('undone before matching')
    assert 'recalibrate' not in status.message
    status_when(bench, is_ok, PAIR)


def test_a_suspicion_ends_with_the_first_pair_that_is_rejected_or_missing(bench):
    def not_calibrated(messages):
        messages['right/camera_info'].p = [0.0] * 12

    def without_the_right(messages):
        del messages['right/image_rect']

    def after(change, condition):
        assert SWAPPED in status_when(bench, warns, PAIR[::-1]).message

        def told():
            for _ in range(10):
                bench.rig.publish(*PAIR, change=change)
            return bench.counts_now() and condition(bench.status.message)

        bench.until(told, 'the condition')
        assert 'swapped' not in bench.status.message
        assert bench.counts_now()['suspected fault'] == 'none'

    after(not_calibrated, lambda message: re.match(
        r'rejecting .* pairs/s: right camera_info: the camera is not calibrated', message))
    after(without_the_right, lambda message: message == 'matching 0.0 pairs/s')
    status_when(bench, is_ok, PAIR)


def test_swapped_and_black_images_are_warned_of_once_each_time_and_a_wall_is_not(bench):
    assert '; ' not in status_when(bench, is_ok, PAIR).message
    mark = bench.node.mark()
    for times in (1, 2):
        assert SWAPPED in status_when(bench, warns, PAIR[::-1]).message
        status_when(bench, warns, PAIR[::-1])
        assert bench.node.log(mark).count(SWAPPED) == times
        status_when(bench, is_ok, PAIR)
    assert 'black' in status_when(bench, warns, BLACK).message
    bench.node.logged('the left and right images are black (brightness 2 of 255): uncover')
    status_when(bench, is_ok, PAIR)
    status = status_when(bench, lambda status: 'texture' in status.message, WALL)
    assert is_ok(status)
    assert ('suspected fault', 'plain') in {(one.key, one.value) for one in status.values}
    assert 'little texture' not in bench.node.log()
