# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Who may import whom: the table of rooms, read from the source and not from what runs."""
import ast
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
import re
import sys

import pytest

ROOT = Path(__file__).parents[1]
PACKAGE = 'fuzzy_stereo_ros'
LONGEST_MODULE = 400
SPDX_LINES = ('# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers',
              '# SPDX-License-Identifier: Apache-2.0')
NAMES_THAT_SAY_NOTHING = {'util', 'utils', 'helper', 'helpers', 'common', 'base', 'manager'}
ROS_MODULE = re.compile(r'(rcl|ros|rmw|launch|ament_|tf2|message_filters|cv_bridge|builtin_inter)'
                        r'|\w+_(msgs|srvs)$')
# Nodes, the room of their parts and what launches them, directly in the package; nobody else
# imports them.
ROS_FILES = ('demo', 'demo_listener', 'demo_stage', 'fake_rig', 'launching', 'live_benchmark',
             'live_probe', 'node', 'rigs_file', 'stereo_node')


@dataclass(frozen=True)
class Room:
    libraries: frozenset
    libraries_inside_functions: frozenset
    project: tuple
    ros: bool = False


FLAT = Room(libraries=frozenset({'cv2', 'numba', 'numpy', 'tqdm'}),
            libraries_inside_functions=frozenset(
                {'dask', 'distributed', 'matplotlib', 'rerun', 'skimage'}),
            project=(PACKAGE,))
MATCHING = Room(libraries=frozenset({'cv2', 'numba', 'numpy'}),
                libraries_inside_functions=frozenset(),
                project=(f'{PACKAGE}.matching',))
SIMD = Room(libraries=MATCHING.libraries | {'llvmlite'},
            libraries_inside_functions=frozenset(),
            project=MATCHING.project)
PAIRS = Room(libraries=frozenset({'cv2', 'numpy'}),
             libraries_inside_functions=frozenset({'rosbags', 'yaml'}),
             project=(f'{PACKAGE}.pairs',))
COMPARING = Room(libraries=frozenset({'cv2', 'numpy'}),
                 libraries_inside_functions=frozenset({'tqdm'}),
                 project=tuple(f'{PACKAGE}.{name}' for name in (
                     'comparing', 'evaluation', 'matching', 'pairs', 'pictures')))
BENCHMARKS = Room(libraries=COMPARING.libraries,
                  libraries_inside_functions=frozenset({'matplotlib', 'skimage'}),
                  project=tuple(f'{PACKAGE}.{name}' for name in (
                      'benchmarks', 'comparing', 'evaluation', 'made_scenes', 'matching',
                      'pairs')))
ROS = Room(libraries=FLAT.libraries | {'yaml'},
           libraries_inside_functions=FLAT.libraries_inside_functions,
           project=FLAT.project,
           ros=True)


def room_of(path):
    """Return the room that a file of the package belongs to."""
    parts = PurePosixPath(path).with_suffix('').parts
    if parts[:2] == (PACKAGE, 'matching'):
        return SIMD if parts[2:] == ('kernels', 'simd') else MATCHING
    if parts[:2] == (PACKAGE, 'pairs'):
        return PAIRS
    if parts[:2] == (PACKAGE, 'comparing'):
        return COMPARING
    if parts[:2] == (PACKAGE, 'benchmarks'):
        return BENCHMARKS
    return ROS if parts[1:] and parts[1] in ROS_FILES else FLAT


def imports_of(path, tree):
    """Return (line, full name, is it inside a function) for each import, relative ones too."""
    package = PurePosixPath(path).parent.parts
    found = []

    def visit(node, inside):
        inside = inside or isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda))
        if isinstance(node, ast.Import):
            found.extend((node.lineno, alias.name, inside) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            above = package[:len(package) - node.level + 1] if node.level else ()
            start = '.'.join((*above, *filter(None, [node.module])))
            found.extend((node.lineno, f'{start}.{alias.name}', inside) for alias in node.names)
        elif isinstance(node, ast.Call):
            called = getattr(node.func, 'attr', getattr(node.func, 'id', ''))
            if called in ('import_module', '__import__') and node.args:
                named = getattr(node.args[0], 'value', None)
                found.append((node.lineno, str(named or 'a computed name'), inside))
        for child in ast.iter_child_nodes(node):
            visit(child, inside)

    visit(tree, False)
    return found


def why_refused(room, name, inside):
    """Return what is wrong with importing a name in a room, or None."""
    top = name.split('.')[0]
    if top == PACKAGE:
        if not any(f'{name}.'.startswith(f'{allowed}.') for allowed in room.project):
            return f'imports {name}: outside its room'
        if not room.ros and name.split('.')[1:2] and name.split('.')[1] in ROS_FILES:
            return f'imports {name}: a ROS file'
        return None
    if top in sys.stdlib_module_names or top in room.libraries:
        return None
    if top in room.libraries_inside_functions:
        return None if inside else f'imports {name}: only inside a function'
    if ROS_MODULE.match(top):
        return None if room.ros else f'imports {name}: ROS outside the ROS files'
    return f'imports {name}: not a library of this room'


def breaches(path, source):
    """Return every rule that one source file breaks, as sentences with path and line."""
    found = []
    lines = source.splitlines()
    start = 1 if source.startswith('#!') else 0
    if tuple(lines[start:start + 2]) != SPDX_LINES:
        found.append(f'{path}:1: does not start with the two SPDX lines')
    if PurePosixPath(path).parts[0] != PACKAGE:
        return found
    words = {word for part in PurePosixPath(path).with_suffix('').parts
             for word in part.split('_')}
    found.extend(f'{path}:1: {word!r} says nothing about what a module is for'
                 for word in sorted(words & NAMES_THAT_SAY_NOTHING))
    if len(lines) > LONGEST_MODULE:
        found.append(f'{path}:{LONGEST_MODULE}: has {len(lines)} lines, '
                     f'{LONGEST_MODULE} are allowed')
    room = room_of(path)
    for line, name, inside in imports_of(path, ast.parse(source)):
        reason = why_refused(room, name, inside)
        if reason:
            found.append(f'{path}:{line}: {reason}')
    return found


def source_files():
    """Return the project's Python files, without what make and colcon write beside them."""
    made = {'build', 'dist', 'install', 'log'}
    folders = [folder for folder in ROOT.iterdir()
               if folder.is_dir() and folder.name not in made and folder.name[0] != '.']
    files = [*ROOT.glob('*.py'), *(file for folder in folders for file in folder.rglob('*.py'))]
    return sorted(file.relative_to(ROOT).as_posix() for file in files)


@pytest.mark.parametrize('path', source_files())
def test_a_source_file_keeps_the_rules(path):
    assert breaches(path, (ROOT / path).read_text(encoding='utf-8')) == []


def test_the_rules_are_read_over_the_whole_package():
    assert f'{PACKAGE}/__init__.py' in source_files()
    assert f'{PACKAGE}/matching/__init__.py' in source_files()
    assert 'setup.py' in source_files()


def made_source(*body):
    return '\n'.join((*SPDX_LINES, *body, ''))


def inside_a_function(line):
    return f'def function():\n    {line}'


IN_MATCHING = f'{PACKAGE}/matching/operators.py'
IN_KERNELS = f'{PACKAGE}/matching/kernels/scanlines/sweep.py'
IN_SIMD = f'{PACKAGE}/matching/kernels/simd.py'
IN_PAIRS = f'{PACKAGE}/pairs/bags.py'
IN_COMPARING = f'{PACKAGE}/comparing/rivals.py'
IN_BENCHMARKS = f'{PACKAGE}/benchmarks/speed.py'
IN_FLAT = f'{PACKAGE}/worker.py'
IN_NODE = f'{PACKAGE}/stereo_node.py'


@pytest.mark.parametrize(('path', 'line'), [
    (IN_MATCHING, 'import numpy as np'),
    (IN_MATCHING, 'from dataclasses import dataclass'),
    (IN_MATCHING, 'import cv2'),
    (IN_MATCHING, f'from {PACKAGE}.matching.config import MatcherConfig'),
    (IN_MATCHING, 'from .config import MatcherConfig'),
    (IN_KERNELS, 'from numba import njit'),
    (IN_KERNELS, 'from ... import config'),
    (IN_SIMD, 'from llvmlite import ir'),
    (IN_PAIRS, f'from {PACKAGE}.pairs import stereo_pair'),
    (IN_PAIRS, inside_a_function('from rosbags.highlevel import AnyReader')),
    (IN_COMPARING, f'from {PACKAGE}.evaluation import score'),
    (IN_COMPARING, f'from {PACKAGE}.pairs.image_files import read_pair'),
    (IN_COMPARING, inside_a_function('from tqdm import tqdm')),
    (IN_BENCHMARKS, f'from {PACKAGE}.comparing.rivals import dense'),
    (IN_BENCHMARKS, f'from {PACKAGE}.evaluation import score'),
    (IN_BENCHMARKS, f'from {PACKAGE}.matching import StereoMatcher'),
    (IN_BENCHMARKS, f'from {PACKAGE}.pairs.image_files import read_pair'),
    (IN_BENCHMARKS, inside_a_function('from skimage.data import stereo_motorcycle')),
    (IN_FLAT, f'from {PACKAGE}.pairs.stereo_pair import StereoPair'),
    (IN_FLAT, f'from {PACKAGE} import matching'),
    (IN_FLAT, inside_a_function('from matplotlib.figure import Figure')),
    (IN_NODE, 'import rclpy'),
    (IN_NODE, 'from stereo_msgs.msg import DisparityImage'),
    (f'{PACKAGE}/node/inputs.py', 'from rclpy.qos import QoSProfile'),
    (IN_NODE, f'from {PACKAGE}.node.parameters import RosParameters'),
    (IN_NODE, 'import yaml'),
    ('launch/disparity.launch.py', 'from launch_ros.actions import Node'),
    ('test/test_node.py', 'import rclpy'),
])
def test_an_import_of_its_own_room_is_accepted(path, line):
    assert breaches(path, made_source(line)) == []


@pytest.mark.parametrize(('path', 'line', 'reason'), [
    (IN_MATCHING, f'from {PACKAGE}.pairs import stereo_pair', 'outside its room'),
    (IN_MATCHING, f'import {PACKAGE}.pairs.messages', 'outside its room'),
    (IN_MATCHING, 'from ..pairs import stereo_pair', 'outside its room'),
    (IN_MATCHING, 'from .. import evaluation', 'outside its room'),
    (IN_KERNELS, 'from ....pairs.messages import image', 'outside its room'),
    (IN_MATCHING, f'from {PACKAGE}.matching_of_others import a', 'outside its room'),
    (IN_MATCHING, inside_a_function(f'import {PACKAGE}.worker'), 'outside its room'),
    (IN_MATCHING, 'import rclpy', 'ROS outside the ROS files'),
    (IN_MATCHING, 'import scipy', 'not a library of this room'),
    (IN_KERNELS, 'from llvmlite import ir', 'not a library of this room'),
    (IN_PAIRS, f'from {PACKAGE}.matching import Match', 'outside its room'),
    (IN_PAIRS, 'import numba', 'not a library of this room'),
    (IN_PAIRS, 'from sensor_msgs.msg import Image', 'ROS outside the ROS files'),
    (IN_PAIRS, 'from rosbags.highlevel import AnyReader', 'only inside a function'),
    (IN_PAIRS, 'if True:\n    import rosbags', 'only inside a function'),
    (IN_PAIRS, 'class Bag:\n    import rosbags', 'only inside a function'),
    (IN_COMPARING, f'from {PACKAGE}.benchmarks.datasets import Scene', 'outside its room'),
    (IN_COMPARING, f'from {PACKAGE} import command_line', 'outside its room'),
    (IN_COMPARING, 'import rclpy', 'ROS outside the ROS files'),
    (IN_COMPARING, 'import tqdm', 'only inside a function'),
    (IN_BENCHMARKS, f'from {PACKAGE} import command_line', 'outside its room'),
    (IN_BENCHMARKS, 'import rclpy', 'ROS outside the ROS files'),
    (IN_BENCHMARKS, 'import skimage', 'only inside a function'),
    (IN_FLAT, 'import rclpy', 'ROS outside the ROS files'),
    (IN_FLAT, inside_a_function('import rclpy'), 'ROS outside the ROS files'),
    (IN_FLAT, 'from rcl_interfaces.msg import Parameter', 'ROS outside the ROS files'),
    (IN_FLAT, 'from launch import LaunchDescription', 'ROS outside the ROS files'),
    (IN_FLAT, "import importlib\nimportlib.import_module('rclpy')", 'ROS outside the ROS files'),
    (IN_FLAT, "__import__('rclpy')", 'ROS outside the ROS files'),
    (IN_FLAT, f'from {PACKAGE}.stereo_node import main', 'a ROS file'),
    (IN_FLAT, f'from {PACKAGE} import fake_rig', 'a ROS file'),
    (IN_FLAT, f'from {PACKAGE}.node.inputs import Inputs', 'a ROS file'),
    (IN_FLAT, 'import matplotlib', 'only inside a function'),
    (IN_FLAT, 'import torch', 'not a library of this room'),
    (IN_FLAT, 'import yaml', 'not a library of this room'),
    (IN_NODE, 'import torch', 'not a library of this room'),
    (f'{PACKAGE}/pairs/stereo_node.py', 'import rclpy', 'ROS outside the ROS files'),
    (f'{PACKAGE}/more/stereo_node.py', 'import rclpy', 'ROS outside the ROS files'),
])
def test_an_import_from_another_room_is_refused(path, line, reason):
    (breach,) = breaches(path, made_source(line))
    assert breach.endswith(reason)


@pytest.mark.parametrize('name', [
    'utils.py', 'image_helpers.py', 'pairs/common.py', 'base/parts.py', 'manager.py'])
def test_a_module_name_that_says_nothing_is_refused(name):
    (breach,) = breaches(f'{PACKAGE}/{name}', made_source())
    assert 'says nothing' in breach


def test_a_module_may_have_400_lines_and_no_more():
    longest = made_source(*['value = 1'] * 398)
    assert breaches(IN_FLAT, longest) == []
    (breach,) = breaches(IN_FLAT, longest + 'value = 1\n')
    assert 'has 401 lines' in breach


@pytest.mark.parametrize('source', [
    '', 'import os\n', SPDX_LINES[0] + '\n', '\n' + made_source(),
    '\n'.join(reversed(SPDX_LINES))])
def test_a_file_without_the_spdx_lines_at_its_start_is_refused(source):
    for path in (IN_FLAT, 'test/test_worker.py', 'setup.py'):
        (breach,) = breaches(path, source)
        assert 'SPDX' in breach


def test_the_spdx_lines_may_follow_a_shebang():
    assert breaches('launch/start.py', '#!/usr/bin/env python3\n' + made_source()) == []
