# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The node with a life cycle, brought up and down as Nav2's lifecycle manager does it."""
from contextlib import ExitStack
import os
import re

from made_messages import shows
from made_scenes import shifted_pair
from node_process import own_domain
from pages import text_of
import pytest

pytest.importorskip('lifecycle_msgs.srv', reason='lifecycle_msgs is not importable: no ROS 2 here')
from lifecycle_manager import Manager  # noqa: E402, I100

SHIFT = 7
PAIR = shifted_pair(SHIFT)
INPUTS = ('/left/image_rect', '/left/camera_info', '/right/image_rect', '/right/camera_info')


@pytest.fixture
def start(make_bench):
    """Return a function that starts the managed node and returns its `Bench`."""
    with ExitStack() as started:
        yield lambda *arguments: started.enter_context(make_bench(
            '--ros-args', '-p', 'disparity_range:=16', *arguments,
            module='fuzzy_stereo_ros.node.managed_node'))


def subscribed(bench):
    return sum(bench.listener.count_subscribers(topic) for topic in INPUTS)


def advertised(bench):
    return bench.listener.count_publishers('/disparity')


def named_by_the_policy():
    """Return the topics and services of SECURITY.md's policy, and those named beside it."""
    page = text_of('SECURITY.md')
    besides = re.search(r'`managed_disparity_node` has the same name(.*?)\n\n', page, re.DOTALL)
    return {name.replace('~', '/disparity_node') if name[0] in '~/' else f'/{name}'
            for name in [*re.findall(r'<(?:topic|service)>(.*?)<', page),
                         *re.findall('`(~.*?)`', besides[1])]}


def threads(bench):
    return len(os.listdir(f'/proc/{bench.node.identity}/task'))


def ends_well(bench):
    assert bench.node.finish() == 0
    assert 'Traceback' not in bench.node.log() and 'ERROR' not in bench.node.log()


def test_it_matches_while_it_is_active_alone_and_cleanup_gives_back_threads_and_topics(start):
    bench = start()
    manager = Manager(bench)
    bench.listen()
    listener, left = bench.listener, []     # threads, those of libraries among them, which stay

    def found():
        return {name for of_node in (
            listener.get_publisher_names_and_types_by_node,
            listener.get_subscriber_names_and_types_by_node,
            listener.get_service_names_and_types_by_node)
            for name, _ in of_node('disparity_node', '/')}

    assert manager.state() == 'unconfigured'
    assert 'loading the kernels' not in bench.node.log()
    for disparities in (16, 24, 16):
        assert (advertised(bench), subscribed(bench)) == (0, 0)
        assert bench.set_parameters(disparity_range=disparities) == (True, '')
        assert manager.change('configure') == 'inactive'
        bench.node.logged('ready: the kernels are warm')
        bench.until(lambda: advertised(bench) == 1, 'the output is advertised')
        bench.counts_now()
        assert bench.status.message == 'idle: not activated'
        assert subscribed(bench) == 0
        assert manager.change('activate') == 'active'
        bench.until(lambda: subscribed(bench) == len(INPUTS), 'the node subscribes')
        bench.until(lambda: found() >= named_by_the_policy() - {'/clock', '/parameter_events'},
                    'the graph')
        assert found() <= named_by_the_policy()
        assert shows(bench.first_match(*PAIR), SHIFT)
        assert bench.match(*PAIR).max_disparity == disparities - 1
        busy = threads(bench)
        assert manager.change('deactivate') == 'inactive'
        bench.until(lambda: subscribed(bench) == 0, 'the node leaves the cameras')
        unseen = bench.rig.publish(*PAIR)
        bench.counts_now()
        assert unseen not in bench.disparities
        assert manager.change('cleanup') == 'unconfigured'
        bench.until(lambda: advertised(bench) + subscribed(bench) == 0, 'the topics are gone')
        bench.until(lambda: threads(bench) < busy, 'its threads have ended')  # noqa: B023
        left.append(threads(bench))
    assert left[2] <= left[1] + 1       # one of the middleware's may come or go
    assert not [name for name in found() if name.endswith(('/reset', '/save'))]
    assert [manager.change(name) for name in ('configure', 'activate')] == ['inactive', 'active']
    ends_well(bench)


def test_a_signal_ends_it_with_code_0_before_it_is_configured(start):
    bench = start()
    Manager(bench)
    ends_well(bench)


def test_a_transition_that_is_not_allowed_or_cannot_be_fails_with_why_and_the_node_lives(start):
    bench = start('-p', 'qos_overrides./disparity.publisher.reliability:=maybe')
    manager = Manager(bench)
    for _ in range(2):
        assert manager.change('configure') == 'unconfigured'
        bench.node.logged('cannot be configured: Unexpected QoS override')
    for change in ({'id': 3}, {'id': 200}, {'label': 'activate'}, {'label': 'none'}):
        assert not manager.asked(**change)
    assert manager.state() == 'unconfigured'
    bench.node.logged('transition 3 is not possible while the node is unconfigured; possible are '
                      '1 (configure), 5 (shutdown)')
    assert manager.asked(label='shutdown') and manager.state() == 'finalized'
    assert not manager.asked(id=1)
    bench.node.logged('possible are none')
    assert bench.node.finish() == 0


def test_a_transition_that_fails_by_a_fault_is_logged_and_what_is_inactive_can_be_shut_down(
        ros, monkeypatch):
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
            assert node.count_publishers('/disparity') == 1
            assert node.trigger_shutdown() == TransitionCallbackReturn.SUCCESS
            assert node.count_publishers('/disparity') == 0
        finally:
            node.destroy_node()
            rclpy.shutdown(context=context)
