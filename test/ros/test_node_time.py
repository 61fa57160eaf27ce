# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The real node with a clock of its own: bags that loop, clocks that go back."""
from fuzzy_stereo_ros.pairs.messages import stamp_of
from made_messages import shows
from made_scenes import shifted_pair
import pytest

SHIFT = 7
PAIR = shifted_pair(SHIFT)
SMALL = ('--ros-args', '-p', 'disparity_range:=16')
SECOND = 1_000_000_000


@pytest.fixture(scope='module')
def bench(make_bench):
    """Return a node that matches before there is a clock, and `bench.set_clock(ns)`."""
    from rclpy.time import Time
    from rosgraph_msgs.msg import Clock
    with make_bench(*SMALL, '-p', 'use_sim_time:=true') as bench:
        clock = bench.listener.create_publisher(Clock, '/clock', 1)
        bench.set_clock = lambda now: clock.publish(Clock(clock=Time(nanoseconds=now).to_msg()))
        bench.clock = clock
        bench.begin(*PAIR)
        bench.until(lambda: bench.listener.count_subscribers('/clock'), 'the node hears /clock')
        yield bench


def values_at(bench, now):
    """Return the values of diagnostics from a time of the clock, ns, on."""
    from ros_bench import values_in
    bench.diagnostics.clear()
    bench.set_clock(now)

    def at_that_time():
        return next((message for message in bench.diagnostics
                     if stamp_of(message.header) == now), None)

    message = bench.until(at_that_time, 'diagnostics')
    return values_in(message)


def play(bench, stamps):
    """Play pairs of a bag with its clock; each is answered."""
    for stamp in stamps:
        bench.set_clock(stamp)
        assert shows(bench.match(*PAIR, stamp=stamp), SHIFT)


def test_a_bag_that_loops_is_matched_in_each_round_and_starts_anew(bench):
    stamps = [100 * SECOND + number * SECOND // 30 for number in range(4)]
    play(bench, stamps)
    before = int(values_at(bench, stamps[-1] + 1)['stamps went back'])
    for _ in range(2):
        play(bench, stamps)
    assert int(values_at(bench, stamps[-1] + 1)['stamps went back']) == before + 2
    bench.node.logged('the clock jumped back')
    bench.node.logged('timestamps jumped back')
    assert 'Traceback' not in bench.node.log()


def test_a_clock_before_the_epoch_is_survived_and_diagnostics_have_the_time_of_the_clock(bench):
    from builtin_interfaces.msg import Time
    from rosgraph_msgs.msg import Clock
    bench.clock.publish(Clock(clock=Time(sec=-1)))
    bench.node.logged('message on /clock rejected: Seconds value must not be negative')
    play(bench, [800 * SECOND])
    assert values_at(bench, 800 * SECOND)['age, last'] == '0.0 ms'
