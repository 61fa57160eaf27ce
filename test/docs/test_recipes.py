# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The recipes and viewers' files: they parse, and ask this node for what it has."""
import json
from pathlib import Path
import re

from fuzzy_stereo_ros.pairs.result_messages import TOPICS
from fuzzy_stereo_ros.parameters.table import ROS_PARAMETERS
from pages import in_code_style, ROOT, text_of
import pytest
import yaml

FOLDER = ROOT / 'docs' / 'recipes'
LAUNCHES = sorted(path.name for path in FOLDER.glob('*.launch.yaml'))
SHARE, HERE = '$(find-pkg-share fuzzy_stereo_ros)', '$(dirname)'
OUTPUTS = {topic for several in TOPICS.values() for topic, _ in several}
INPUTS = {f'{side}/{name}' for side in ('left', 'right') for name in ('image_rect', 'camera_info')}
ROWS = {row.name: row for row in ROS_PARAMETERS}


def actions_of(name):
    """Return (arguments of our launch file, nodes of the consumers) of a launch file."""
    ours, *others = yaml.safe_load((FOLDER / name).read_text(encoding='utf-8'))['launch']
    assert ours['include']['file'] == f'{SHARE}/launch/fuzzy_stereo.launch.py'
    return ({one['name']: one['value'] for one in ours['include']['arg']},
            [one['node'] for one in others])


def place_of(path):
    """Return the Path of a file that a launch file names."""
    return Path(path.replace(SHARE, str(ROOT)).replace(HERE, str(FOLDER)))


def parameters_of(path):
    """Return the parameters of a file for nodes of any name."""
    return yaml.safe_load(Path(path).read_text(encoding='utf-8'))['/**']['ros__parameters']


def strings_in(content):
    """Yield all texts in nested maps and lists, keys too."""
    if isinstance(content, str):
        yield content
    for one in content if isinstance(content, list) else ():
        yield from strings_in(one)
    for key, value in content.items() if isinstance(content, dict) else ():
        yield key
        yield from strings_in(value)


@pytest.mark.parametrize('name', LAUNCHES)
def test_a_recipe_gives_this_node_arguments_that_it_allows(name):
    arguments, _ = actions_of(name)
    preset = parameters_of(place_of(arguments.pop('params_file')))
    assert set(preset) == {'confidence_threshold'}
    for argument, value in arguments.items():
        assert isinstance(value, str)       # launch takes no other arguments
        ROWS[argument].checked(yaml.safe_load(value))


@pytest.mark.parametrize('name', LAUNCHES)
def test_a_recipe_s_consumers_get_topics_that_there_are_and_files_that_parse(name):
    _, nodes = actions_of(name)
    assert nodes
    for node in nodes:
        for remap in node.get('remap', []):
            assert remap['to'] in OUTPUTS | INPUTS
            assert remap['from'] not in OUTPUTS
        for one in node['param']:
            if 'from' in one:
                parameters_of(place_of(one['from']))
    read = [*FOLDER.glob(f"{name.split('.')[0]}.yaml")]
    assert {f'{HERE}/{path.name}' for path in read} <= set(strings_in(nodes))


def test_nav2_marks_and_clears_with_points_of_this_node_as_far_as_it_sends_them():
    arguments, _ = actions_of('nav2.launch.yaml')
    layer = parameters_of(FOLDER / 'nav2.yaml')['voxel_layer']
    marks, clears = (layer[source] for source in layer['observation_sources'].split())
    for source, key in ((marks, 'marking'), (clears, 'clearing')):
        assert source['topic'].lstrip('/') in OUTPUTS
        assert source[key] and source['data_type'] == 'PointCloud2'
    assert clears['min_obstacle_height'] < 0 < marks['min_obstacle_height']
    assert marks['obstacle_max_range'] < clears['raytrace_max_range'] < float(
        arguments['points_max_depth'])


@pytest.mark.parametrize('name', [*LAUNCHES, 'viewers'])
def test_a_page_leads_to_its_files_and_says_what_to_watch_out_for(name):
    stem = name.split('.')[0]
    page = f'docs/recipes/{stem}.md'
    text = text_of(page)
    assert f'\n{stem}\n' in text_of('docs/recipes/index.md')
    assert '\nWatch out for\n' in text
    for path in FOLDER.glob(f'{stem}.*yaml'):
        assert path.name in text
    ours = {word for word in in_code_style(page) if re.match('points_|confidence_|scale', word)}
    assert ours <= set(ROWS)


@pytest.mark.parametrize('name, read', [
    ('stereo.rviz', yaml.safe_load), ('foxglove.json', json.loads)])
def test_a_viewer_shows_topics_that_there_are(name, read):
    shown = {text.lstrip('/') for text in strings_in(read(text_of(f'config/{name}')))
             if re.fullmatch(r'/[\w/]+', text)} - {'disparity_node'}
    assert shown <= OUTPUTS | INPUTS | {'diagnostics'}
    assert 'points2' in shown


@pytest.mark.parametrize('name', LAUNCHES)
def test_launch_itself_reads_a_recipe(name):
    parser = pytest.importorskip('launch.frontend', reason='launch comes with ROS 2').Parser
    pytest.importorskip('launch_ros', reason='launch_ros comes with ROS 2')
    entity, parser = parser.load(str(FOLDER / name))
    assert len(parser.parse_description(entity).entities) == 1 + len(actions_of(name)[1])
