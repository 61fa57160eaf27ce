# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Several rigs: two nodes in one process take turns at its one worker."""
from node_process import own_domain, shifted_pair, START, values_of
import numpy as np
import pytest

PAIRS = {'/front': shifted_pair(7), '/back': shifted_pair(11, seed=1)}
SHIFTS = {'/front': 7, '/back': 11}


LEFT_ELSEWHERE = '-r left/image_rect:=cam_left/image -r left/camera_info:=cam_left/camera_info'


def rig_arguments(namespace):
    return '--rig', f'-r __ns:={namespace} {LEFT_ELSEWHERE} -p disparity_range:=16'


@pytest.fixture
def around(make_bench):
    """Return a bench of one process with two nodes, each with a fake rig and a dict of answers."""
    from fuzzy_stereo_ros.synthetic.fake_rig import FakeRig
    from ros_bench import BASELINE, Bench, FOCAL
    from stereo_msgs.msg import DisparityImage
    with own_domain() as domain:
        bench = Bench(domain, *rig_arguments('/front'), *rig_arguments('/back'))
        bench.rigs, bench.answers = {}, {'/front': {}, '/back': {}}
        try:
            for namespace, answers in bench.answers.items():
                rig = FakeRig('rig', namespace, [], FOCAL, BASELINE, 30.0, reliable=True,
                              context=bench.context,
                              cli_args=['--ros-args', *LEFT_ELSEWHERE.split()])
                bench.rigs[namespace] = rig
                bench.executor.add_node(rig)
                bench.collect(DisparityImage, f'{namespace}/disparity', answers)
            bench.until(lambda: all(rig.subscribed() for rig in bench.rigs.values()),
                        'both nodes subscribe', START)
            yield bench
        finally:
            for rig in bench.rigs.values():
                rig.destroy_node()
            bench.close()


def test_both_rigs_are_matched_and_none_starves_the_other(around):
    for _ in range(40):
        for namespace, rig in around.rigs.items():
            rig.publish(*PAIRS[namespace])
        around.executor.spin_once(timeout_sec=0.01)
    last = {namespace: rig.sent[-1] for namespace, rig in around.rigs.items()}
    around.until(lambda: all(last[name] in around.answers[name] for name in last),
                 'the newest pair of both')
    for namespace, answers in around.answers.items():
        assert len(answers) >= 10
        for message in answers.values():
            near = np.abs(values_of(message.image)[:, 15:] - SHIFTS[namespace]) < 0.5
            assert near.mean() > 0.95
    names = around.listener.get_node_names_and_namespaces()
    assert {('disparity_node', '/front'), ('disparity_node', '/back')} <= set(names)
    assert around.node.finish() == 0
    assert 'Traceback' not in around.node.log()


def test_a_flood_from_one_rig_leaves_the_other_its_turns(around):
    flood, calm = around.rigs['/front'], around.rigs['/back']
    big = shifted_pair(7, rows=240, columns=320)
    for _ in range(10):
        sent = calm.publish(*PAIRS['/back'])
        waiting = around.answers['/back']
        around.until(lambda: flood.publish(*big) and sent in waiting,  # noqa: B023
                     'an answer to the calm rig')


@pytest.mark.parametrize('arguments, sentence', [
    (('--rigs', 'front'), 'unrecognized arguments: --rigs front'),
    (('--rig',), 'argument --rig: expected one argument'),
    (('--rig', '-p disparity_range:=0'), 'disparity_range is 0; allowed are whole numbers'),
    (('--rig=--no-such-flag',), 'no-such-flag'),
])
def test_arguments_that_make_no_rig_end_it_with_code_2_and_a_sentence(
        start_node, arguments, sentence):
    node = start_node(*arguments)
    assert node.finish(number=None) == 2
    assert sentence in node.log()
    assert 'Traceback' not in node.log()
