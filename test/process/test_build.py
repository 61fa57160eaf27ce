# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Archive and wheel are built and work in a clean folder, and colcon builds the package."""
import os
import shutil
import subprocess
import tarfile
from xml.etree import ElementTree
import zipfile

from pages import commands, ROOT
import pytest
from repository import printed_by

NOT_COPIED = {'build', 'dist', 'docs', 'install', 'log', 'test'}


def built(kind, source, target):
    """Return the archive that the build backend makes of a source folder: 'sdist' or 'wheel'."""
    code = f'from setuptools import build_meta; print(build_meta.build_{kind}({str(target)!r}))'
    return target / printed_by('-c', code, folder=source).splitlines()[-1]


@pytest.fixture(scope='module')
def archives(tmp_path_factory):
    """Return the source archive, and the wheel that is built of it in a clean folder."""
    pytest.importorskip('setuptools', '70.1', reason='older ones build no wheels by themselves')
    place = tmp_path_factory.mktemp('built')
    source = place / 'source'
    source.mkdir()
    for path in ROOT.iterdir():
        if not (path.name.startswith('.') or path.name in NOT_COPIED
                or path.suffix == '.egg-info'):
            (source / path.name).symlink_to(path)
    archive = built('sdist', source, place)
    return archive, built('wheel', unpack(archive, place), place)


def unpack(archive, place):
    """Return the folder that a source archive has, unpacked into a place."""
    with tarfile.open(archive) as files:
        files.extractall(place / 'unpacked', filter='data')
    (unpacked,) = (place / 'unpacked').iterdir()
    return unpacked


@pytest.fixture(scope='module')
def prefix(archives, tmp_path_factory):
    """Return a clean folder into which the wheel is installed, without what it depends on."""
    return installed(archives[1], tmp_path_factory.mktemp('prefix'))


def installed(wheel, folder):
    """Install a wheel into a clean folder and return that."""
    printed_by('-m', 'pip', 'install', '--quiet', '--no-index', '--no-deps', '--no-compile',
               '--ignore-installed', '--prefix', folder, wheel)
    return folder


def test_the_wheel_has_every_module_and_nothing_else_of_python(archives):
    with zipfile.ZipFile(archives[1]) as files:
        modules = {name for name in files.namelist()
                   if name.endswith('.py') and '.data/' not in name}
    assert modules == {path.relative_to(ROOT).as_posix()
                       for path in (ROOT / 'fuzzy_stereo_ros').rglob('*.py')}


def test_installed_into_a_clean_folder_its_files_are_where_ros_looks_for_them(prefix):
    share = prefix / 'share' / 'fuzzy_stereo_ros'
    for folder in ('config', 'launch'):
        for path in (ROOT / folder).iterdir():
            if path.is_file():
                assert (share / folder / path.name).read_bytes() == path.read_bytes()
    assert (share / 'package.xml').read_bytes() == (ROOT / 'package.xml').read_bytes()
    assert (prefix / 'share/ament_index/resource_index/packages/fuzzy_stereo_ros').is_file()
    for name in ('disparity_node', 'simulated_cameras'):
        assert os.access(prefix / 'lib' / 'fuzzy_stereo_ros' / name, os.X_OK)
        assert os.access(prefix / 'bin' / name, os.X_OK)


def test_installed_into_a_clean_folder_the_command_runs_and_tells_its_version(prefix, tmp_path):
    (packages,) = prefix.glob('**/site-packages')
    environment = {**os.environ, 'PYTHONPATH': str(packages)}
    told = printed_by('-c', 'import fuzzy_stereo_ros as one; print(one.__file__, one.__version__)',
                      folder=tmp_path, PYTHONPATH=str(packages)).split()
    assert told[0].startswith(str(prefix))
    assert f'<version>{told[1]}</version>' in (ROOT / 'package.xml').read_text(encoding='utf-8')
    printed = subprocess.run([prefix / 'bin' / 'fuzzy-stereo', '--help'], check=True, text=True,
                             capture_output=True, env=environment, cwd=tmp_path).stdout
    assert 'match two images' in printed


NEEDS_COLCON = pytest.mark.skipif(
    shutil.which('colcon') is None,
    reason='colcon is not installed: pip install colcon-common-extensions')
IGNORED = shutil.ignore_patterns(
    '.*', '__pycache__', '*.egg-info', 'build', 'dist', 'install', 'log', '_build')


@NEEDS_COLCON
def test_colcon_builds_the_package_and_runs_its_tests(tmp_path):
    shutil.copytree(ROOT, tmp_path / 'src' / 'fuzzy_stereo_ros', ignore=IGNORED)
    environment = {name: value for name, value in os.environ.items()
                   if name != 'PYTHONPATH' and not name.startswith('PYTEST')}
    for words in commands('docs/develop.md', 'colcon'):
        done = subprocess.run(words, cwd=tmp_path, env=environment, text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        assert done.returncode == 0, f"{' '.join(words)}:\n{done.stdout}"
    installed = tmp_path / 'install' / 'fuzzy_stereo_ros'
    for place in ('bin/fuzzy-stereo', 'lib/fuzzy_stereo_ros/disparity_node',
                  'share/fuzzy_stereo_ros/launch/fuzzy_stereo.launch.py'):
        assert (installed / place).is_file(), place
    suite = ElementTree.parse(tmp_path / 'build' / 'fuzzy_stereo_ros' / 'pytest.xml')
    (figures,) = suite.getroot().iter('testsuite')
    assert int(figures.get('tests')) > 5
    assert [figures.get(bad) for bad in ('errors', 'failures', 'skipped')] == ['0', '0', '0']
