# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The YAML file of several rigs: what is read, and the sentence for what is not allowed."""
from fuzzy_stereo_ros.saved_pairs.versions import package_version
from launched import FOLDER, WHY
import pytest

ros_arguments = pytest.importorskip('fuzzy_stereo_ros.node.launching', reason=WHY).ros_arguments
read_rigs = pytest.importorskip('fuzzy_stereo_ros.node.rigs_file', reason=WHY).read_rigs
CAMERAS = [('left/image_rect', 'left/image_rect'), ('left/camera_info', 'left/camera_info'),
           ('right/image_rect', 'right/image_rect'), ('right/camera_info', 'right/camera_info')]


@pytest.fixture
def read(tmp_path):
    """Return a function that reads rigs from a text."""
    def read(text):
        (tmp_path / 'rigs.yaml').write_text(text, encoding='utf-8')
        return read_rigs(tmp_path / 'rigs.yaml')

    return read


def test_a_rig_of_which_nothing_is_said_has_its_name_as_namespace(read):
    one_process, (rig,) = read('rigs: {front: }')
    assert one_process is False
    assert (rig.namespace, rig.node_name) == ('front', 'disparity_node')
    assert (rig.params_file, rig.parameters) == ('', {})
    assert rig.remappings == CAMERAS


def test_everything_that_is_said_of_a_rig_is_in_its_ros_arguments(read, tmp_path):
    (tmp_path / 'my file.yaml').touch()
    one_process, (rig,) = read("""
one_process: true
rigs:
  front:
    namespace: /robot/front
    node_name: stereo
    left_namespace: /one
    right_namespace: /two
    params_file: my file.yaml
    parameters: {deadline_ms: 40, profile: quality, fill: true, use_sim_time: true, P1: 200.0}
    remappings: {left/image_rect: /one/mono, disparity: depth}
""")
    assert one_process is True
    assert ros_arguments(rig) == [
        '-r', '__ns:=/robot/front', '-r', '__node:=stereo',
        '-r', 'left/image_rect:=/one/mono', '-r', 'disparity:=depth',
        '-r', 'left/image_rect:=/one/image_rect', '-r', 'left/camera_info:=/one/camera_info',
        '-r', 'right/image_rect:=/two/image_rect', '-r', 'right/camera_info:=/two/camera_info',
        '--params-file', str(tmp_path / 'my file.yaml'),
        '-p', 'deadline_ms:=40.0', '-p', 'profile:="quality"', '-p', 'fill:=true',
        '-p', 'use_sim_time:=true', '-p', 'P1:=200.0']


def test_a_file_in_a_home_that_is_not_there_is_named(read, monkeypatch):
    monkeypatch.delenv('HOME', raising=False)
    monkeypatch.setattr('pwd.getpwuid', {}.__getitem__)     # knows nobody
    with pytest.raises(ValueError, match="rig 'front': params_file is '.*/~/its.yaml'"):
        read('rigs: {front: {params_file: ~/its.yaml}}')


@pytest.mark.parametrize('base, given, namespace', [
    (None, 'front', '/front'), ('/robot', 'front', '/robot/front'), ('/robot', '/front', '/front'),
    (None, '/', '/')])
def test_a_namespace_around_the_launch_file_is_before_that_of_a_rig(read, base, given, namespace):
    _, (rig,) = read(f'rigs: {{front: {{namespace: {given}}}}}')
    assert ros_arguments(rig, base)[1] == f'__ns:={namespace}'


def test_the_example_is_read():
    one_process, (front, rear) = read_rigs(FOLDER.parent / 'config' / 'rigs.yaml')
    assert one_process is False
    assert front.parameters['disparity_range'] == 128
    assert rear.remappings[0] == ('left/image_rect', '/rear_cameras/left/image_rect')


@pytest.mark.parametrize('text, sentence', [
    ('', 'the file is None; allowed are maps with one_process, rigs, version'),
    ('- front', "the file is ['front']; allowed are maps with one_process, rigs, version"),
    ('rig: {}', "the file has the key 'rig'; allowed are one_process, rigs, version"),
    ('one_process: false', "there are no rigs; give 'rigs:' with a map from names to rigs"),
    ('rigs: [front]', "the file: rigs is ['front']; allowed are maps"),
    ('one_process: 1\nrigs: {a: }', 'the file: one_process is 1; allowed are true or false'),
    ('rigs: {front: 3}', "rig 'front' is 3; allowed are maps with namespace, node_name, "
     'left_namespace, right_namespace, params_file, parameters, remappings'),
    ('rigs: {front: {name: stereo}}', "rig 'front' has the key 'name'; allowed are namespace, "
     'node_name, left_namespace, right_namespace, params_file, parameters, remappings'),
    ('rigs: {front: {namespace: 3}}', "rig 'front': namespace is 3; allowed are texts"),
    ('rigs: {front: {parameters: 3}}', "rig 'front': parameters is 3; allowed are maps"),
    ('rigs: {front: {node_name: a/b}}', "rig 'front': node_name is 'a/b'; allowed are letters, "
     'digits and _, beginning with no digit'),
    ('rigs: {my rig: }', "rig 'my rig': namespace is 'my rig'; allowed are letters, digits and "
     '_, beginning with no digit, parted by /'),
    ('rigs: {front: {remappings: {a: 3}}}',
     "rig 'front': remappings has 'a': 3; allowed are names of topics"),
    ('rigs: {front: {parameters: {disparity_rang: 3}}}',
     "rig 'front': parameters has 'disparity_rang' (is disparity_range meant?), and no parameter "
     'of the node is called so; config/fuzzy_stereo.yaml lists them'),
    ('version: 2\nshapes: {}', f'it has version 2 of its format, fuzzy_stereo_ros '
     f'{package_version()} reads version 1; take a newer fuzzy_stereo_ros'),
    ('version: 0\nrigs: {a: }', f'it has version 0 of its format, fuzzy_stereo_ros '
     f'{package_version()} reads version 1; take the fuzzy_stereo_ros that it was made with, or '
     'make it anew: CHANGELOG.rst tells what has changed'),
    ('rigs: {front: {parameters: {queue_size: 0}}}',
     "rig 'front': queue_size is 0; allowed are numbers from 1 to 1000000"),
    ('rigs: {a: , b: {namespace: /a}}', "rig 'b' has the namespace and node_name of rig 'a'; "
     'give it another of one of them'),
])
def test_what_is_not_allowed_is_told_in_one_sentence(read, tmp_path, text, sentence):
    with pytest.raises(ValueError) as raised:
        read(text)
    assert str(raised.value) == f"the file of rigs {tmp_path / 'rigs.yaml'}: {sentence}"


@pytest.mark.parametrize('text, sentence', [
    ('rigs: {front: {params_file: none.yaml}}', "rig 'front': params_file is '"),
    ('rigs: {', 'cannot be read: while parsing'),
])
def test_a_file_that_is_no_yaml_or_is_not_there_is_named(read, text, sentence):
    with pytest.raises(ValueError) as raised:
        read(text)
    assert sentence in str(raised.value)
    assert '\n' not in str(raised.value)
