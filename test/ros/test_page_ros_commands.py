# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The `ros2` commands of the pages, by what they stand for, with the real node."""
import ast

from fuzzy_stereo_ros.pairs.result_messages import TOPICS
from fuzzy_stereo_ros.parameters.table import ROS_PARAMETERS
from made_scenes import shifted_pair
from pages import commands, pages_with_commands, ROOT
import pytest
import yaml

ALL = [words for page in pages_with_commands() for words in commands(page, 'ros2')]
LAUNCHES = [words for words in ALL if words[1] == 'launch']
OTHERS = [words for words in ALL if words[1] != 'launch']
ROWS = {row.name: row for row in ROS_PARAMETERS}
PAIR = shifted_pair(7)


def in_one_line(words):
    return ' '.join(words)


@pytest.fixture(scope='module')
def bench(make_bench, tmp_path_factory):
    folder = tmp_path_factory.mktemp('saved')
    with make_bench('--ros-args', '-p', 'disparity_range:=16', '-p',
                    f'save_directory:={folder}') as bench:
        bench.begin(*PAIR)
        yield bench


def type_of(topic):
    """Return the message class of a topic of the node or of the cameras."""
    from diagnostic_msgs.msg import DiagnosticArray
    from fuzzy_stereo_ros.node.publications import TYPES
    from sensor_msgs.msg import CameraInfo

    outputs = {f'/{name}': TYPES[kind] for several in TOPICS.values() for name, kind in several}
    cameras = {f'/{side}/camera_info': CameraInfo for side in ('left', 'right')}
    return {'/diagnostics': DiagnosticArray, **outputs, **cameras}[topic]


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
    bench.match(*PAIR)
    done, sentence = bench.trigger(service.rpartition('/')[2])
    assert done, sentence


def echo(bench, *words):
    *options, topic = words
    fields = [name for option, name in zip(options, options[1:]) if option == '--field']
    messages = {}
    bench.collect(type_of(topic), topic, messages)
    bench.until(lambda: bench.rig.publish(*PAIR) and messages, topic)
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


@pytest.mark.parametrize('words', OTHERS, ids=in_one_line)
def test_a_ros_command_does_what_it_says_with_the_real_node(bench, words):
    MEANINGS[tuple(words[1:3])](bench, *words[3:])


def arguments_of(file):
    """Return the names of the arguments that a launch file has besides the node's parameters."""
    tree = ast.parse((ROOT / 'launch' / file).read_text(encoding='utf-8'))
    return {call.args[0].value for call in ast.walk(tree)
            if isinstance(call, ast.Call) and getattr(call.func, 'id', '') == 'Parameter'}


@pytest.mark.parametrize('words', LAUNCHES, ids=in_one_line)
def test_a_launch_command_has_arguments_of_its_file_with_allowed_values(words):
    _, _, package, file, *given = words
    assert package == 'fuzzy_stereo_ros'
    if given == ['--show-args']:
        given = []
    settings = dict(word.split(':=') for word in given)
    assert settings.keys() <= arguments_of(file) | ROWS.keys()
    for name in settings.keys() & ROWS.keys():
        ROWS[name].checked(yaml.safe_load(settings[name]))
