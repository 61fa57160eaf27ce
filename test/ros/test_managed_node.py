# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The node with a life cycle, brought up and down as Nav2's lifecycle manager does it."""
from functools import partial
import os
import re
import signal

from made_messages import shows
from made_scenes import shifted_pair
from node_process import NodeProcess, own_domain
from pages import text_of
import pytest

pytest.importorskip('lifecycle_msgs.srv', reason='lifecycle_msgs is not importable: no ROS 2 here')

SHIFT = 7
PAIR = shifted_pair(SHIFT)
INPUTS = ('/left/image_rect', '/left/camera_info', '/right/image_rect', '/right/camera_info')
SMALL = '--ros-args', '-p', 'disparity_range:=16'


@pytest.fixture
def start(ros):
    """Return a function that starts the managed node and returns its `Bench`."""
    from ros_bench import Bench

    class ManagedBench(Bench):
        node_type = partial(NodeProcess, module='fuzzy_stereo_ros.node.managed_node')

    with own_domain() as domain:
        benches = []

        def started(*arguments):
            benches.append(ManagedBench(domain, *SMALL, *arguments))
            return benches[-1]

        yield started
        for bench in benches:
            bench.close()


def manager_of(bench):
    from lifecycle_manager import Manager
    return Manager(bench)


def subscribed(bench):
    return sum(bench.listener.count_subscribers(topic) for topic in INPUTS)


def advertised(bench):
    return bench.listener.count_publishers('/disparity')


def threads(bench):
    return len(os.listdir(f'/proc/{bench.node.identity}/task'))


def test_it_matches_while_it_is_active_and_only_then(start):
    bench = start()
    manager = manager_of(bench)
    bench.listen()
    assert manager.state() == 'unconfigured'
    assert (advertised(bench), subscribed(bench)) == (0, 0)
    assert 'loading the kernels' not in bench.node.log()
    assert manager.change('configure') == 'inactive'
    bench.node.logged('ready: the kernels are warm')
    bench.until(lambda: advertised(bench) == 1, 'the output is advertised')
    bench.counts_now()
    assert bench.status.message == 'idle: not activated'
    assert subscribed(bench) == 0
    for _ in range(2):
        assert manager.change('activate') == 'active'
        bench.until(lambda: subscribed(bench) == len(INPUTS), 'the node subscribes')
        assert shows(bench.first_match(*PAIR), SHIFT)
        assert manager.change('deactivate') == 'inactive'
        bench.until(lambda: subscribed(bench) == 0, 'the node leaves the cameras')
        unseen = bench.rig.publish(*PAIR)
        bench.counts_now()
        assert unseen not in bench.disparities
    assert 'Traceback' not in bench.node.log()


def test_cleanup_gives_back_threads_and_topics_and_it_can_be_configured_anew(start):
    bench = start()
    manager = manager_of(bench)
    bench.listen()
    left = []       # threads, those of libraries among them, which stay
    for disparities in (16, 24, 16):
        assert bench.set_parameters(disparity_range=disparities) == (True, '')
        assert manager.change('configure') == 'inactive'
        assert manager.change('activate') == 'active'
        bench.until(lambda: subscribed(bench) == len(INPUTS), 'the node subscribes')
        assert bench.first_match(*PAIR).max_disparity == disparities - 1
        busy = threads(bench)
        assert manager.change('deactivate') == 'inactive'
        assert manager.change('cleanup') == 'unconfigured'
        bench.until(lambda: advertised(bench) + subscribed(bench) == 0, 'the topics are gone')
        bench.until(lambda: threads(bench) < busy, 'its threads have ended')  # noqa: B023
        left.append(threads(bench))
    assert left[2] <= left[1] + 1       # one of the middleware's may come or go
    services = bench.listener.get_service_names_and_types_by_node('disparity_node', '/')
    assert not [name for name, _ in services if name.endswith(('/reset', '/save'))]


def test_it_has_the_topics_and_services_of_the_policy_and_those_that_are_named_beside_it(start):
    page = text_of('SECURITY.md')
    policy = set(re.findall(r'<(?:topic|service)>(.*?)<', page))
    besides = re.search(r'`managed_disparity_node` has the same name(.*?)\n\n', page, re.DOTALL)
    allowed = {name.replace('~', '/disparity_node') if name[0] in '~/' else f'/{name}'
               for name in policy | set(re.findall('`(~.*?)`', besides[1]))}
    bench = start()
    manager = manager_of(bench)
    assert manager.change('configure') == 'inactive'
    assert manager.change('activate') == 'active'
    bench.listen()
    listener = bench.listener

    def found():
        return {name for of_node in (
            listener.get_publisher_names_and_types_by_node,
            listener.get_subscriber_names_and_types_by_node,
            listener.get_service_names_and_types_by_node)
            for name, _ in of_node('disparity_node', '/')}
    bench.until(lambda: found() >= allowed - {'/clock', '/parameter_events'}, 'the graph')
    assert found() <= allowed


@pytest.mark.parametrize('steps, end', [
    ((), signal.SIGINT), (('configure',), 'shutdown'), (('configure', 'activate'), signal.SIGINT)])
def test_it_can_be_shut_down_from_every_state_and_a_signal_ends_the_process_with_0(
        start, steps, end):
    bench = start()
    manager = manager_of(bench)
    for step in steps:
        manager.change(step)
    if end == 'shutdown':
        assert manager.change('shutdown') == 'finalized'
        bench.until(lambda: advertised(bench) + subscribed(bench) == 0, 'the topics are gone')
    assert bench.node.finish() == 0
    assert 'Traceback' not in bench.node.log() and 'ERROR' not in bench.node.log()


def test_what_cannot_be_configured_is_said_and_leaves_it_unconfigured(start):
    bench = start('-p', 'qos_overrides./disparity.publisher.reliability:=maybe')
    manager = manager_of(bench)
    for _ in range(2):
        assert manager.change('configure') == 'unconfigured'
        bench.node.logged('cannot be configured: Unexpected QoS override')
    assert bench.node.finish() == 0


def test_a_transition_that_the_state_does_not_allow_fails_and_the_node_lives(start):
    bench = start()
    manager = manager_of(bench)
    for change in ({'id': 3}, {'id': 200}, {'label': 'activate'}, {'label': 'none'}):
        assert not manager.asked(**change)
    assert manager.state() == 'unconfigured'
    bench.node.logged('transition 3 is not possible while the node is unconfigured; possible are '
                      '1 (configure), 5 (shutdown)')
    assert manager.change('shutdown') == 'finalized'
    assert not manager.asked(id=1)
    bench.node.logged('possible are none')
    assert bench.node.finish() == 0


def test_a_transition_that_fails_by_a_fault_is_logged_and_ends_unconfigured(ros, monkeypatch):
    import rclpy
    from rclpy.lifecycle import TransitionCallbackReturn
    with own_domain() as domain:
        from fuzzy_stereo_ros.node.managed_node import ManagedDisparityNode
        context = rclpy.Context()
        rclpy.init(context=context, domain_id=domain)
        node = ManagedDisparityNode(context=context)
        try:
            errors = []
            monkeypatch.setattr(node.get_logger(), 'error', errors.append)
            monkeypatch.setattr(node, 'activate', lambda: 1 / 0)
            assert node.trigger_configure() == TransitionCallbackReturn.SUCCESS
            assert node.trigger_activate() == TransitionCallbackReturn.ERROR
            assert 'ZeroDivisionError' in errors[0]
            assert node.trigger_configure() == TransitionCallbackReturn.SUCCESS
        finally:
            node.destroy_node()
            rclpy.shutdown(context=context)
