# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The services of the real node, and the `ros2` commands of the pages by what they stand for."""
from contextlib import closing
import json
import shutil
import threading
from types import SimpleNamespace

from fuzzy_stereo_ros.commands.command_line import main
from made_messages import values_of
from made_scenes import noisy as made_noisy, shifted_pair
from node_process import own_domain, SOON
import numpy as np
from pages import commands, pages_with_commands
import pytest
import yaml

LEFT, RIGHT = shifted_pair(7)
COMMANDS = [words for page in pages_with_commands() for words in commands(page, 'ros2')
            if words[1] != 'launch']    # those: see test_launch_arguments.py


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
    shutil.rmtree(min(saved.iterdir()))
    assert bench.match(LEFT, RIGHT) and bench.trigger('save')[0]
    shutil.rmtree(min(saved.iterdir()))     # for the command of a page


def test_one_pair_is_saved_at_a_time_and_a_fault_meanwhile_is_an_answer_too(
        ros, tmp_path, monkeypatch):
    from fuzzy_stereo_ros.node import services
    import rclpy
    from ros_bench import Surroundings
    from std_srvs.srv import Trigger
    go_on = threading.Event()

    def fail(**_):
        go_on.wait(SOON)
        raise MemoryError('there is none')

    monkeypatch.setattr(services, 'SavedPair', fail)
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

        first = client.call_async(Trigger.Request())
        success, message = answered(client.call_async(Trigger.Request()))
        assert (success, message.split(';')[0]) == (False, 'another pair is being saved')
        go_on.set()
        success, message = answered(first)
        assert not success and message.endswith('MemoryError: there is none')
        monkeypatch.setattr(services, 'SavedPair', dict)
        monkeypatch.setattr(services, 'write_saved_pair', lambda folder, saved: None)
        assert answered(client.call_async(Trigger.Request()))[0]
        node.destroy_node()


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


# ---- the `ros2` commands of the pages ----


def set_parameter(bench, node, name, value):
    assert node == '/disparity_node'
    (before,) = bench.parameters(name)
    assert bench.set_parameters(**{name: yaml.safe_load(value)}) == (True, '')
    assert bench.parameters(name) == [yaml.safe_load(value)]
    assert bench.set_parameters(**{name: before}) == (True, '')


def describe(bench, node, name):
    assert node == '/disparity_node'
    assert bench.descriptor(name).description


def call(bench, service, kind):
    assert kind == 'std_srvs/srv/Trigger'
    assert service.startswith('/disparity_node/')
    bench.match(LEFT, RIGHT)
    done, sentence = bench.trigger(service.rpartition('/')[2])
    assert done, sentence


def echo(bench, *words):
    from diagnostic_msgs.msg import DiagnosticArray
    from stereo_msgs.msg import DisparityImage
    *options, topic = words
    kind = {'/diagnostics': DiagnosticArray, '/disparity': DisparityImage}[topic]
    fields = [name for option, name in zip(options, options[1:]) if option == '--field']
    messages = {}
    bench.collect(kind, topic, messages)
    bench.until(lambda: bench.rig.publish(LEFT, RIGHT) and messages, topic)
    (_, message), *_ = messages.items()
    for name in fields:
        assert hasattr(message, name)


def is_there(bench, *words):
    topic = words[-1]
    bench.until(lambda: topic in dict(bench.listener.get_topic_names_and_types()), topic)


def node_is_there(bench, name):
    bench.until(lambda: name in [f'{namespace}{node}' for node, namespace
                                 in bench.listener.get_node_names_and_namespaces()], name)


def recorded(bench, *words):
    for topic in words[words.index('--topics') + 1:]:
        is_there(bench, topic)


MEANINGS = {('bag', 'record'): recorded, ('param', 'set'): set_parameter,
            ('param', 'describe'): describe, ('service', 'call'): call,
            ('topic', 'echo'): echo, ('topic', 'hz'): is_there, ('topic', 'info'): is_there,
            ('node', 'info'): node_is_there}


@pytest.mark.parametrize('words', COMMANDS, ids=' '.join)
def test_a_ros_command_does_what_it_says_with_the_real_node(bench, words):
    if not bench.subscriptions:
        bench.begin(LEFT, RIGHT)
    MEANINGS[tuple(words[1:3])](bench, *words[3:])
