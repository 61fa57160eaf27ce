# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The real node warns where it is all but blind, with the cause, and of nothing else."""
from diagnostic_msgs.msg import DiagnosticStatus
from fuzzy_stereo_ros.synthetic.scenes import make_pair
import numpy as np

PAIR = make_pair(240, 320, 32, seed=2, objects=6, noise=2.0)[:2]
WALL, BLACK = (2 * (np.full((240, 320), level, np.uint8),) for level in (90, 2))
SWAPPED = 'left and right are swapped: '


def status_when(bench, condition, pair):
    """Match a pair until the status of diagnostics fulfils a condition; return the status."""
    def told():
        for _ in range(6):
            bench.match(*pair)
        bench.counts_now()
        return condition(bench.status)

    bench.until(told, 'the condition')
    return bench.status


def warns(status):
    return status.level == DiagnosticStatus.WARN


def is_ok(status):
    return status.level == DiagnosticStatus.OK


def test_swapped_and_black_images_are_warned_of_once_each_time_and_a_wall_is_not(make_bench):
    with make_bench('--ros-args', '-p', 'disparity_range:=32') as bench:
        bench.begin(*PAIR)
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
