# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Arguments of the launch files: which there are, and what a wrong one is told."""
import sys

from fuzzy_stereo_ros.parameters.table import IGNORED_PARAMETERS, ROS_PARAMETERS
from launched import actions, launch_ros, PEER, PROFILES_FILE, visited
from node_process import ros_environment
from pages import commands, pages_with_commands
import pytest

OUR_OWN = ('node_name', 'params_file', 'managed', 'queue_size',
           'approximate_sync_tolerance_seconds', 'image_transport', 'use_sim_time', 'log_level',
           'output')
FILES = FUZZY_STEREO, DEMO = 'fuzzy_stereo.launch.py', 'demo.launch.py'


@pytest.fixture(autouse=True)
def environment(monkeypatch, tmp_path):
    """Set what launch needs, and keep what it sets out of the other tests."""
    for name, value in ros_environment(tmp_path / 'log').items():
        monkeypatch.setenv(name, value)


def notices(context, found):
    """Return the sentences of the LogInfo actions among those of a launch file."""
    return [''.join(part.perform(context) for part in action.msg)
            for action in found if isinstance(action, actions.LogInfo)]


def argument_names(file):
    return {action.name for action in visited(file)[1]
            if isinstance(action, actions.DeclareLaunchArgument)}


def test_every_parameter_and_every_argument_of_the_peers_launch_file_is_an_argument():
    names = argument_names(FUZZY_STEREO)
    assert names >= {*(row.name for row in ROS_PARAMETERS), *IGNORED_PARAMETERS, *PEER, *OUR_OWN}


@pytest.mark.parametrize('file, name, value, sentence', [
    (FUZZY_STEREO, 'disparity_range', 'many',
     "disparity_range is 'many'; allowed are whole numbers from 1 to 4096"),
    (FUZZY_STEREO, 'disparity_range', '0',
     'disparity_range is 0; allowed are whole numbers from 1 to 4096'),
    (FUZZY_STEREO, 'output', 'paper',
     "output is 'paper'; allowed are screen, log, both, own_log, full"),
    (FUZZY_STEREO, 'params_file', '/no/such.yaml',
     "params_file is '/no/such.yaml', which is no file; give the path of a file of parameters, "
     'or nothing for the defaults'),
    (DEMO, 'disparities', '700', 'disparities is 700; allowed are 1 to the 640 columns'),
])
def test_a_wrong_value_ends_in_one_sentence(file, name, value, sentence):
    with pytest.raises(ValueError) as raised:
        visited(file, **{name: value})
    assert str(raised.value) == sentence


@pytest.mark.parametrize('words', [words for page in pages_with_commands()
                                   for words in commands(page, 'ros2 launch')], ids=' '.join)
def test_a_launch_command_of_a_page_has_arguments_of_its_file_with_allowed_values(words):
    _, _, package, file, *given = words
    assert package == 'fuzzy_stereo_ros'
    settings = dict(word.split(':=') for word in given if word != '--show-args')
    assert settings.keys() <= argument_names(file)
    visited(file, **settings)


def test_a_container_is_told_that_the_node_runs_beside_it():
    context, found = visited(FUZZY_STEREO, container='/my_container', node_name='stereo')
    assert notices(context, found) == [
        'container:=/my_container: a Python node cannot be loaded into a container of '
        'components; stereo runs as a process of its own']
    assert notices(*visited(FUZZY_STEREO)) == []


def test_a_profile_of_fast_dds_that_is_set_is_kept(monkeypatch):
    for name in ('FASTDDS_DEFAULT_PROFILES_FILE', PROFILES_FILE):
        monkeypatch.delenv(PROFILES_FILE, raising=False)
        monkeypatch.setenv(name, '/my/profile.xml')
        for file in FILES:
            assert not any(isinstance(action, actions.SetEnvironmentVariable)
                           for action in visited(file)[1])
        monkeypatch.delenv(name)


def test_without_an_installed_package_python_runs_the_module(monkeypatch, tmp_path):
    def programs():
        return [action.node_executable for action in visited(DEMO, viewer='False')[1]
                if isinstance(action, launch_ros.Node)]

    monkeypatch.setenv('AMENT_PREFIX_PATH', str(tmp_path))
    assert programs() == [sys.executable] * 2
    monkeypatch.delenv('AMENT_PREFIX_PATH')
    assert programs() == [sys.executable] * 2
