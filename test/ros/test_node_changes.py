# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The real node while changed parameters are prepared, which here takes until it is told."""
from contextlib import closing
from queue import SimpleQueue
from types import SimpleNamespace

from fuzzy_stereo_ros import pair_matcher
from fuzzy_stereo_ros.matching import StereoMatcher
from made_scenes import shifted_pair
from node_process import own_domain, SOON, START
import pytest

PAIR = shifted_pair(7)


@pytest.fixture
def gate(monkeypatch, ros):
    """Return where warming up waits: begun has its disparities, let has None or what to raise."""
    gate = SimpleNamespace(begun=SimpleQueue(), let=SimpleQueue())

    class Gated(StereoMatcher):
        def warm_up(self, rows, columns):
            if self.config.disparities != 16:
                gate.begun.put((self.config.disparities, rows, columns))
                error = gate.let.get(timeout=SOON)
                if error is not None:
                    raise error
            super().warm_up(rows, columns)

    monkeypatch.setattr(pair_matcher, 'StereoMatcher', Gated)
    return gate


@pytest.fixture
def bench(gate):
    """Return surroundings with the node in this process, spun along with them."""
    from fuzzy_stereo_ros.node.disparity_node import DisparityNode
    from rclpy.parameter import Parameter
    from ros_bench import Bench, Surroundings

    class Inside(Bench):
        heard = Surroundings.heard

        def __init__(self, domain):
            Surroundings.__init__(self, domain)
            self.node = DisparityNode(
                context=self.context,
                parameter_overrides=[Parameter('disparity_range', value=16)])
            self.executor.add_node(self.node)

        def check(self):
            assert self.node.exit_code == 0

        def close(self):
            gate.let.put(None)
            assert self.node.destroy_node()
            Surroundings.close(self)

        def said(self, text):
            return self.until(lambda: text in self.counts()['change of parameters'], text)

    with own_domain() as domain, closing(Inside(domain)) as bench:
        bench.listen()
        bench.until(bench.rig.subscribed, 'the node subscribes to the rig', START)
        bench.first_match(*PAIR)
        yield bench


def test_pairs_are_matched_with_the_old_value_until_the_new_one_is_prepared(bench, gate):
    gate.let.put(MemoryError('no more'))
    bench.set_parameters(disparity_range=32)
    assert gate.begun.get(timeout=SOON)[0] == 32
    bench.said('cannot be prepared: disparity_range = 32 (in use: 16)')
    before = bench.counts()
    assert bench.set_parameters(disparity_range=24) == (True, '')
    assert gate.begun.get(timeout=SOON) == (24, *PAIR[0].shape)
    assert [bench.match(*PAIR).max_disparity for _ in range(5)] == 5 * [15.0]
    assert bench.parameters('disparity_range') == [24]
    values = bench.counts()
    assert values['disparity_range in use'] == '16'
    assert values['change of parameters'] == (
        'being prepared: disparity_range = 24 (in use: 16)')
    gate.let.put(None)
    bench.said('from the next pair on: disparity_range = 24 (in use: 16)')
    assert [bench.match(*PAIR).max_disparity for _ in range(5)] == 5 * [23.0]
    after = bench.counts()
    assert (after['disparity_range in use'], after['change of parameters']) == ('24', 'none')
    assert int(after['pairs matched']) - int(before['pairs matched']) == 10
    for lost in ('pairs dropped', 'pairs rejected', 'pairs waiting'):
        assert after[lost] == before[lost]
