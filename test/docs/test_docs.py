# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Links of the pages lead on; their tables, names, sentences and recipes fit the code."""
import ast
from functools import cache
from pathlib import Path
import re

from bench.page import QUOTE, requoted
from bench.parameter_pages import renewed
from fuzzy_stereo_ros.pairs.result_messages import TOPICS
from fuzzy_stereo_ros.parameters.table import ROS_PARAMETERS
from pages import FENCE, ROOT, said, text_of
import pytest
import yaml

PAGES = sorted(path.relative_to(ROOT).as_posix() for pattern in (
    '*.rst', '*.md', 'docs/*.md', 'docs/recipes/*.md') for path in ROOT.glob(pattern))
OUTSIDE = re.compile(r'(https?|mailto):')


def anchors(text):
    """Return the anchors of a page's headings, as GitHub and MyST make them."""
    found, taken = [], {}
    for title in re.findall(r'^#+ (.+)$', FENCE.sub('', text), re.MULTILINE):
        plain = re.sub(r'\[([^]]+)\]\([^)]*\)', r'\1', title).strip().lower()
        anchor = re.sub(r'[^\w\- ]', '', plain).replace(' ', '-')
        number = taken[anchor] = taken.get(anchor, -1) + 1
        found.append(f'{anchor}-{number}' if number else anchor)
    return found


def links(path, text):
    """Return the targets of a page's links and pictures that lie inside the project."""
    if path.endswith('.rst'):
        found = re.findall(r'`[^`<]*<([^`>]+)>`_', text)
    else:
        prose = re.sub(r'`[^`\n]*`', '', FENCE.sub('', text))
        found = re.findall(r'\]\(\s*([^)\s]+)', prose)
        found += re.findall(r'^\[[^]]+\]:\s*(\S+)', prose, re.MULTILINE)
        found += re.findall(r'(?:src|href)="([^"]+)"', prose)
    return [target for target in found if not OUTSIDE.match(target)]


def broken(path, text):
    """Return the links of a page that lead nowhere."""
    nowhere = []
    for target in links(path, text):
        name, _, anchor = target.partition('#')
        there = (ROOT / path).parent / name if name else ROOT / path
        if not there.is_file():     # Sphinx copies files, and takes a folder for a missing one
            nowhere.append(target)
        elif anchor:
            to = text if there == ROOT / path else there.read_text(encoding='utf-8')
            if there.suffix != '.md' or anchor not in anchors(to):
                nowhere.append(target)
    return nowhere


@pytest.mark.parametrize('path', PAGES)
def test_every_link_of_a_page_leads_somewhere(path):
    assert broken(path, (ROOT / path).read_text(encoding='utf-8')) == []


@pytest.mark.parametrize('path', ['README.md', 'docs/algorithm.md'])
def test_a_page_quotes_the_page_of_benchmarks(path):
    text = text_of(path)
    assert len(QUOTE.findall(text)) == text.count('<!-- quote ') > 0
    assert requoted(text, text_of('docs/benchmarks.md')) == text, \
        'renew them: python -m bench.page README.md docs/algorithm.md'


def test_the_parameter_tables_are_those_of_the_declaration():
    page = text_of('docs/parameters.md')
    assert renewed(page) == page, \
        'renew them: python -m bench.parameter_pages docs/parameters.md'


@pytest.mark.parametrize('page', [path for path in PAGES if path.endswith('.md')])
def test_every_test_that_a_page_names_exists(page):
    files = list((ROOT / 'test').rglob('test_*.py'))
    names = {file.stem for file in files} | {
        name for file in files
        for name in re.findall(r'^def (test_\w+)', file.read_text(encoding='utf-8'), re.MULTILINE)}
    assert set(re.findall(r'\btest_\w+', text_of(page))) <= names


NAME = 'docs/troubleshooting.md'
CODE = [ROOT / name for name in ('fuzzy_stereo_ros', 'launch')]


@cache
def texts():
    """Return all texts in the code, with … for what they format, in one string of lines."""
    found = []
    for node in (node for folder in CODE for file in folder.rglob('*.py')
                 for node in ast.walk(ast.parse(file.read_text(encoding='utf-8')))):
        parts = node.values if isinstance(node, ast.JoinedStr) else [node]
        if isinstance(node, (ast.Constant, ast.JoinedStr)):
            found.append(''.join(str(part.value) if isinstance(part, ast.Constant) else '…'
                                 for part in parts))
    return '\n'.join(' '.join(text.split()) for text in found)


@pytest.mark.parametrize('sentence', said(NAME))
def test_a_quoted_sentence_is_one_of_the_code(sentence):
    """Part by part, between … for what differs."""
    assert [part for part in map(str.strip, sentence.split('…')) if part not in texts()] == []


# ---- recipes and the files of viewers parse, and ask this node for what it has ----


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
    # Ours is last: behind an include $(dirname) is another folder (ros2/launch, issue 618).
    *others, ours = yaml.safe_load((FOLDER / name).read_text(encoding='utf-8'))['launch']
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
