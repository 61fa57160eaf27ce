# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""In a workspace colcon builds the package and runs its tests, as docs/develop.md says."""
import os
import shutil
import subprocess
from xml.etree import ElementTree

from pages import commands, ROOT
import pytest

pytestmark = pytest.mark.skipif(
    shutil.which('colcon') is None,
    reason='colcon is not installed: pip install colcon-common-extensions')
NOT_COPIED = shutil.ignore_patterns(
    '.*', '__pycache__', '*.egg-info', 'build', 'dist', 'install', 'log', '_build')


def test_colcon_builds_the_package_and_runs_its_tests(tmp_path):
    shutil.copytree(ROOT, tmp_path / 'src' / 'fuzzy_stereo_ros', ignore=NOT_COPIED)
    environment = {name: value for name, value in os.environ.items()
                   if name != 'PYTHONPATH' and not name.startswith('PYTEST')}
    for words in commands('docs/develop.md', 'colcon'):
        done = subprocess.run(words, cwd=tmp_path, env=environment, text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        assert done.returncode == 0, f"{' '.join(words)}:\n{done.stdout}"
    installed = tmp_path / 'install' / 'fuzzy_stereo_ros'
    for place in ('bin/fuzzy-stereo', 'lib/fuzzy_stereo_ros/disparity_node',
                  'share/fuzzy_stereo_ros/launch/rigs.launch.py'):
        assert (installed / place).is_file(), place
    suite = ElementTree.parse(tmp_path / 'build' / 'fuzzy_stereo_ros' / 'pytest.xml')
    (figures,) = suite.getroot().iter('testsuite')
    assert int(figures.get('tests')) > 5
    assert [figures.get(bad) for bad in ('errors', 'failures', 'skipped')] == ['0', '0', '0']
