# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The YAML file of several rigs: what is read, and the sentence for what is not allowed."""
from launched import FOLDER, WHY
import pytest

read_rigs = pytest.importorskip('fuzzy_stereo_ros.node.launching', reason=WHY).read_rigs
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
    (rig,) = read('rigs: {front: }')
    assert (rig.namespace, rig.node_name) == ('front', 'disparity_node')
    assert (rig.params_file, rig.parameters) == ('', {})
    assert rig.remappings == CAMERAS


def test_everything_that_is_said_of_a_rig_is_in_its_node(read, tmp_path):
    (tmp_path / 'my file.yaml').touch()
    (rig,) = read("""
rigs:
  front:
    namespace: /robot/front
    node_name: stereo
    left_namespace: /one
    right_namespace: /two
    params_file: my file.yaml
    parameters: {deadline_ms: 40, fill: true, use_sim_time: true, P1: 200.0,
                 qos_overrides: {/disparity: {publisher: {depth: 4}}}}
    remappings: {left/image_rect: /one/mono, disparity: depth}
""")
    assert (rig.namespace, rig.node_name) == ('/robot/front', 'stereo')
    assert rig.remappings == [
        ('left/image_rect', '/one/mono'), ('disparity', 'depth'),
        ('left/image_rect', '/one/image_rect'), ('left/camera_info', '/one/camera_info'),
        ('right/image_rect', '/two/image_rect'), ('right/camera_info', '/two/camera_info')]
    assert rig.params_file == str(tmp_path / 'my file.yaml')
    assert rig.parameters == {'deadline_ms': 40, 'fill': True, 'use_sim_time': True, 'P1': 200.0,
                              'qos_overrides': {'/disparity': {'publisher': {'depth': 4}}}}


def test_a_file_in_a_home_that_is_not_there_is_named(read, monkeypatch):
    monkeypatch.delenv('HOME', raising=False)
    monkeypatch.setattr('pwd.getpwuid', {}.__getitem__)     # knows nobody
    with pytest.raises(ValueError, match="rig 'front': params_file is '.*/~/its.yaml'"):
        read('rigs: {front: {params_file: ~/its.yaml}}')


def test_the_example_is_read():
    front, rear = read_rigs(FOLDER.parent / 'config' / 'rigs.yaml')
    assert front.parameters['disparity_range'] == 128
    assert rear.remappings[0] == ('left/image_rect', '/rear_cameras/left/image_rect')


@pytest.mark.parametrize('text, sentence', [
    ('', 'the file is None; allowed are maps with rigs'),
    ('- front', "the file is ['front']; allowed are maps with rigs"),
    ('rig: {}', "the file has the key 'rig'; allowed are rigs"),
    ('one_process: true\nrigs: {a: }', "the file has the key 'one_process'; allowed are rigs"),
    ('rigs: {}', "there are no rigs; give 'rigs:' with a map from names to rigs"),
    ('rigs: [front]', "the file: rigs is ['front']; allowed are maps"),
    ('rigs: {front: 3}', "rig 'front' is 3; allowed are maps with namespace, node_name, "
     'left_namespace, right_namespace, params_file, parameters, remappings'),
    ('rigs: {front: {name: stereo}}', "rig 'front' has the key 'name'; allowed are namespace, "
     'node_name, left_namespace, right_namespace, params_file, parameters, remappings'),
    ('rigs: {front: {namespace: 3}}', "rig 'front': namespace is 3; allowed are texts"),
    ('rigs: {front: {parameters: 3}}', "rig 'front': parameters is 3; allowed are maps"),
    ('rigs: {front: {remappings: {a: 3}}}', "rig 'front': remappings: a is 3; allowed are texts"),
    ('rigs: {a: , b: {namespace: /a}}',
     'two rigs have one namespace and node_name; give each its own'),
    ('rigs: {', 'while parsing'),
    ('rigs: {front: {params_file: none.yaml}}', "rig 'front': params_file is '"),
])
def test_what_is_not_allowed_is_told_in_one_sentence(read, tmp_path, text, sentence):
    with pytest.raises(ValueError) as raised:
        read(text)
    assert str(raised.value).startswith(f"the file of rigs {tmp_path / 'rigs.yaml'}: {sentence}")
    assert '\n' not in str(raised.value)
