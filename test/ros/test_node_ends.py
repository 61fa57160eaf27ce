# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""How the real node begins and ends: ready in time, code 0 on signals, a sentence otherwise."""
import signal

from diagnostic_msgs.msg import DiagnosticStatus
from made_scenes import shifted_pair
from node_process import START
import pytest


def test_two_signals_while_it_matches_end_it_with_code_0(make_bench):
    with make_bench('--ros-args', '-p', 'disparity_range:=64') as bench:
        big = shifted_pair(7, rows=480, columns=640)
        bench.begin(*big)
        for _ in range(60):     # more than it can match: its last line tells what was dropped
            bench.rig.publish(*big)
            bench.executor.spin_once(timeout_sec=0)
        bench.node.send(signal.SIGINT)
        assert bench.node.finish(signal.SIGINT) == 0
        log = bench.node.log()
        assert not {word for word in ('Traceback', 'ERROR', 'Failed') if word in log}


def test_a_start_with_kernels_in_the_cache_compiles_none_and_a_signal_ends_it_with_code_0(
        start_node, copy_kernels):
    folder = copy_kernels('realtime')

    def kept():
        return {path: path.stat().st_mtime_ns for path in folder.glob('*.nb?')}

    before = kept()
    node = start_node()
    assert 'the first start on a machine compiles them' in node.logged('loading the kernels')
    assert 'ready: the kernels are warm after' in node.logged('ready')
    assert node.finish(signal.SIGTERM) == 0
    assert kept() == before
    assert 'Traceback' not in node.log()


def test_a_first_start_tells_in_diagnostics_and_in_the_log_how_far_it_is(
        make_bench, copy_kernels):
    folder = copy_kernels('paper', '*.random_numbers.*')

    def kept():
        return {*folder.glob('*.nbc')}

    def told(sentence):
        return lambda: next((message for message in bench.diagnostics
                             if message.status[0].message.startswith(sentence)), None)

    before = kept()
    with make_bench('--ros-args', '-p', 'profile:=paper') as bench:
        loading = bench.until(told('compiling the kernels: '), 'how far it is', START)
        assert loading.status[0].level == DiagnosticStatus.STALE
        bench.until(told('idle: '), 'that it is ready', START)
        assert bench.node.logged('compiling the kernels: 0 %')
        assert kept() > before


@pytest.mark.parametrize('arguments, sentence', [
    (('--ros-args', '--params-file', '/there/is/none.yaml'), "Couldn't parse params file"),
    (('--ros-args', '-p', 'image_transport:=pigeon'),
     "image_transport is 'pigeon'; allowed are raw, compressed"),
    (('--ros-args', '-p', 'qos_overrides./disparity.publisher.reliability:=maybe'),
     'Unexpected QoS override'),
    (('disparity_range:=128',), 'unrecognized arguments: disparity_range:=128; a parameter is '
     'given by --ros-args -p NAME:=VALUE'),
])
def test_a_start_that_cannot_be_ends_with_code_2_and_one_line(start_node, arguments, sentence):
    node = start_node(*arguments)
    assert node.finish(number=None) == 2
    assert sentence in node.log().splitlines()[-1]
    assert 'Traceback' not in node.log()


def test_a_bad_qos_of_an_input_ends_it_with_code_2_when_it_subscribes(make_bench):
    override = 'qos_overrides./left/image_rect.subscription.reliability:=maybe'
    with make_bench('--ros-args', '-p', override) as bench:
        bench.listen()
        bench.node.logged('cannot subscribe: Unexpected QoS override', timeout=START)
        assert bench.node.finish(number=None) == 2
