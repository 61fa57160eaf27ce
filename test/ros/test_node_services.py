# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The services of the real node: forget, and save what `fuzzy-stereo match` makes again."""
from contextlib import closing
from functools import partial
import json
import threading
from types import SimpleNamespace

from fuzzy_stereo_ros.commands.command_line import main
from made_messages import values_of
from made_scenes import noisy as made_noisy, shifted_pair
from node_process import own_domain, SOON
import numpy as np
import pytest

LEFT, RIGHT = shifted_pair(7)


def noisy(seed):
    """Return the pair with noise: what a warm start has something to say about."""
    return made_noisy((LEFT, RIGHT), 5, np.random.default_rng(seed))


@pytest.fixture(scope='module')
def saved(tmp_path_factory):
    return tmp_path_factory.mktemp('of_the_node') / 'saved'


@pytest.fixture(scope='module')
def bench(make_bench, saved):
    with make_bench('--ros-args', '-p', 'disparity_range:=16', '-p', 'max_saved_pairs:=2', '-p',
                    f'save_directory:={saved}') as bench:
        bench.node.logged('ready')
        assert bench.trigger('save') == (False, 'no pair has been matched yet; nothing is saved')
        yield bench


def test_a_saved_pair_is_matched_again_bit_for_bit(bench, saved, tmp_path, capsys):
    bench.begin(*noisy(0))
    for seed in range(1, 5):
        message = bench.match(*noisy(seed))
    done, sentence = bench.trigger('save')
    assert done, sentence
    (folder,) = saved.iterdir()
    assert sentence == (
        f'saved to {folder}; match it again with `fuzzy-stereo match --saved {folder}`')
    output = tmp_path / 'again.npy'
    assert main(['match', '--saved', str(folder), '--output', str(output)]) == 0
    assert 'bit for bit' in capsys.readouterr().out
    again = np.load(output)
    published = values_of(message.image)
    valid = published >= message.min_disparity
    np.testing.assert_array_equal(valid, np.isfinite(again))
    np.testing.assert_array_equal(published[valid], np.maximum(again, 0)[valid])
    about = json.dumps(json.loads((folder / 'pair.json').read_text()))
    assert '"parameter disparity_range": "16"' in about


def test_no_more_pairs_are_saved_than_the_parameter_allows(bench, saved):
    bench.match(LEFT, RIGHT)
    while len([*saved.iterdir()]) < 2:
        assert bench.trigger('save')[0]
    before = set(saved.rglob('*'))
    done, sentence = bench.trigger('save')
    assert not done
    assert sentence.endswith(f'{saved} has 2 saved pairs, and max_saved_pairs is 2; remove '
                             'some, or start the node with more')
    assert set(saved.rglob('*')) == before
    changed, reason = bench.set_parameters(max_saved_pairs=3)
    assert not changed and 'read-only parameter: max_saved_pairs' in reason
    bench.match(LEFT, RIGHT)


@pytest.fixture
def asked(ros, tmp_path):
    """Yield a client of ~/save of a node that has matched a pair, and what awaits an answer."""
    from fuzzy_stereo_ros.node import services
    import rclpy
    from ros_bench import Surroundings
    from std_srvs.srv import Trigger

    last = SimpleNamespace(pair=None, config=None, before=None, rows=None, match=None)
    with own_domain() as domain, closing(Surroundings(domain)) as around:
        node = rclpy.create_node('asked', context=around.context)
        services.Services(node, SimpleNamespace(last=last), str(tmp_path), 3, dict)
        around.executor.add_node(node)
        client = around.listener.create_client(Trigger, '/asked/save')
        around.until(client.service_is_ready, 'the service')

        def answered(future):
            around.until(future.done, 'an answer')
            return future.result().success, future.result().message

        yield partial(client.call_async, Trigger.Request()), answered
        node.destroy_node()


def test_a_fault_while_a_pair_is_saved_is_an_answer_too(asked, monkeypatch):
    from fuzzy_stereo_ros.node import services

    def fail(**_):
        raise MemoryError('there is none')

    monkeypatch.setattr(services, 'SavedPair', fail)
    ask, answered = asked
    success, message = answered(ask())
    assert not success
    assert message.endswith('MemoryError: there is none')


def test_one_pair_is_saved_at_a_time_and_the_next_caller_is_told(asked, monkeypatch):
    from fuzzy_stereo_ros.node import services

    go_on = threading.Event()
    monkeypatch.setattr(services, 'SavedPair', lambda **_: go_on.wait(SOON))
    monkeypatch.setattr(services, 'write_saved_pair', lambda folder, saved: None)
    ask, answered = asked
    first = ask()
    success, message = answered(ask())
    assert (success, message.split(';')[0]) == (False, 'another pair is being saved')
    go_on.set()
    assert answered(first)[0]
    assert answered(ask())[0]


def test_reset_has_the_next_pair_matched_as_if_it_were_the_first(bench):
    bench.trigger('reset')
    stamp = 2_000_000_000_000
    before = stamp - 33_000_000

    def matched():
        return values_of(bench.match(*noisy(1), stamp=stamp).image)

    alone = matched()
    bench.match(*noisy(2), stamp=before)
    assert (matched() != alone).any()
    assert bench.counts()['warm start'] == 'true'
    bench.match(*noisy(2), stamp=before)
    assert bench.trigger('reset') == (True, 'the next pair is matched without the previous frame')
    np.testing.assert_array_equal(matched(), alone)
    assert bench.counts()['warm start'] == 'false'
