# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The installed package: said once, complete, and where pip and ROS look for it."""
import ast
from importlib import metadata
import os
from pathlib import Path
import subprocess
import sys
from xml.etree import ElementTree

import fuzzy_stereo_ros
from fuzzy_stereo_ros import matching
import pytest
from repository import ROOT

PACKAGE = 'fuzzy_stereo_ros'
MANIFEST = ElementTree.parse(ROOT / 'package.xml').getroot()
NODES = 'disparity_node', 'managed_disparity_node', 'simulated_cameras'
COMMANDS = {*NODES, 'fuzzy-stereo'}
# Extras of setup.py that rosdep does not know; what needs them says so.
OPTIONAL = {'argcomplete', 'av', 'dask', 'distributed', 'rosbags'}
ROSDEP_KEYS = {'cv2': 'python3-opencv', 'llvmlite': 'python3-numba', **{
    name: f'python3-{name}' for name in ('jinja2', 'matplotlib', 'numba', 'numpy', 'pandas',
                                         'psutil', 'scipy', 'skimage', 'tqdm', 'yaml')}}


def test_the_manifest_depends_on_everything_that_is_imported():
    names = set()
    for file in [*(ROOT / PACKAGE).rglob('*.py'), *(ROOT / 'launch').glob('*.py')]:
        for node in ast.walk(ast.parse(file.read_text(encoding='utf-8'))):
            if isinstance(node, ast.Import):
                names.update(alias.name.split('.')[0] for alias in node.names)
            elif isinstance(node, ast.ImportFrom) and not node.level:
                names.add(node.module.split('.')[0])
    declared = {child.text for child in MANIFEST if child.tag in ('depend', 'exec_depend')}
    needed = names - set(sys.stdlib_module_names) - {PACKAGE} - OPTIONAL
    assert {ROSDEP_KEYS.get(name, name) for name in needed} - declared == set()


def test_the_metadata_is_what_the_manifest_says():
    installed = metadata.metadata(PACKAGE)
    assert installed['Version'] == MANIFEST.findtext('version')
    assert installed['Summary'] == MANIFEST.findtext('description')
    assert installed['License'] == MANIFEST.findtext('license')
    assert installed['Maintainer'] == MANIFEST.find('maintainer').text
    assert fuzzy_stereo_ros.__version__ == MANIFEST.findtext('version')


def test_importing_the_package_loads_nothing_heavy():
    code = f'import sys, {PACKAGE}; print(*dir({PACKAGE}), *sys.modules)'
    printed = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True,
                             check=True)
    assert {'cv2', 'numba', 'numpy', 'rclpy'} & set(printed.stdout.split()) == set()
    for name in fuzzy_stereo_ros.__all__:
        assert getattr(fuzzy_stereo_ros, name) is getattr(matching, name)
        assert name in printed.stdout.split()


@pytest.mark.parametrize('name', sorted(COMMANDS))
def test_a_command_leads_to_a_function_and_is_installed_where_shells_and_ros_look(name):
    prefixes = [*os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep), sys.prefix]
    marker = f'share/ament_index/resource_index/packages/{PACKAGE}'
    prefix = next(Path(prefix) for prefix in prefixes
                  if prefix and (Path(prefix) / marker).is_file())
    assert os.access(prefix / 'bin' / name, os.X_OK)
    if name in NODES:
        assert os.access(prefix / 'lib' / PACKAGE / name, os.X_OK)
        pytest.importorskip('rclpy', reason='the node needs ROS 2')
    (script,) = metadata.distribution(PACKAGE).entry_points.select(name=name)
    assert callable(script.load())
