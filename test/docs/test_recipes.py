# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The recipes and viewers' files: they parse, and ask this node for what it has."""
from pathlib import Path
import re

from fuzzy_stereo_ros.pairs.result_messages import TOPICS
from fuzzy_stereo_ros.parameters.table import ROS_PARAMETERS
from pages import ROOT, text_of
import pytest
import yaml

FOLDER = ROOT / 'docs' / 'recipes'
LAUNCHES = sorted(path.name for path in FOLDER.glob('*.launch.yaml'))
SHARE, HERE = '$(find-pkg-share fuzzy_stereo_ros)', '$(dirname)'
OUTPUTS = {topic for several in TOPICS.values() for topic, _ in several}
INPUTS = {f'{side}/{name}' for side in ('left', 'right') for name in ('image_rect', 'camera_info')}
ROWS = {row.name: row for row in ROS_PARAMETERS}


def parameters_of(path):
    """Return the parameters, for nodes of any name, of a file that a launch file names."""
    place = path.replace(SHARE, str(ROOT)).replace(HERE, str(FOLDER))
    return yaml.safe_load(Path(place).read_text(encoding='utf-8'))['/**']['ros__parameters']


@pytest.mark.parametrize('name', LAUNCHES)
def test_a_recipe_gives_arguments_and_topics_that_there_are_and_files_that_parse(name):
    ours, *others = yaml.safe_load((FOLDER / name).read_text(encoding='utf-8'))['launch']
    assert ours['include']['file'] == f'{SHARE}/launch/fuzzy_stereo.launch.py'
    arguments = {one['name']: one['value'] for one in ours['include']['arg']}
    assert set(parameters_of(arguments.pop('params_file'))) == {'confidence_threshold'}
    for argument, value in arguments.items():
        assert isinstance(value, str)       # launch takes no other arguments
        ROWS[argument].checked(yaml.safe_load(value))
    for node in (other['node'] for other in others):
        for remap in node.get('remap', []):
            assert remap['to'] in OUTPUTS | INPUTS
            assert remap['from'] not in OUTPUTS
        for one in node['param']:
            if 'from' in one:
                parameters_of(one['from'])


@pytest.mark.parametrize('name', ['stereo.rviz', 'foxglove.json'])
def test_a_viewer_shows_topics_that_there_are(name):
    shown = set(re.findall(r'[" ]/([\w/]+)["\n]', text_of(f'config/{name}'))) - {'disparity_node'}
    assert shown <= OUTPUTS | INPUTS | {'diagnostics'}
    assert 'points2' in shown
