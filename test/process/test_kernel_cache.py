# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Compiled kernels are kept where it is possible, used only where they fit, and nothing breaks."""
from importlib import import_module
import json
import os
from pathlib import Path
import platform
import re
import shutil
import subprocess
import sys
from types import FunctionType

from fuzzed import is_long
import fuzzy_stereo_ros.matching.kernels as kernels
from fuzzy_stereo_ros.matching.kernels import compiled
from mounted import as_stranger, mounting
import numba
import pytest

SOURCES = Path(kernels.__file__).parent
MACHINERY = '__init__', 'compiled'
START = """# a kernel
from fuzzy_stereo_ros.matching.kernels.compiled import called, kernel
"""
CALLEE = START + """

@called
def step(number):
    return number + {}
"""
CALLER = START + """from fuzzy_stereo_ros.matching.kernels.callee import step


@kernel
def steps(number):
    return step(step(number))
"""
PROGRAM = """
import json, os, sys
import numba
from fuzzy_stereo_ros.matching.kernels.caller import steps
from fuzzy_stereo_ros.matching.kernels.compiled import FOLDER
from fuzzy_stereo_ros.matching.kernels.compiled import remarks
told = remarks()
if len(sys.argv) > 2:
    with open(sys.argv[2], 'wb', buffering=0) as others:
        try:
            while others.write(bytes(4096)):
                pass
        except OSError:
            pass
print(json.dumps({'result': steps(json.loads(sys.argv[1])),
                  'hits': sum(steps.stats.cache_hits.values()), 'folder': str(FOLDER),
                  'remarks': told + remarks(), 'setting': numba.config.CACHE_DIR}))
"""


@pytest.fixture
def package(tmp_path):
    """Return the folder of kernels of a copy of the package that has two of them."""
    place = tmp_path / 'code' / 'fuzzy_stereo_ros' / 'matching' / 'kernels'
    place.mkdir(parents=True)
    for folder in place.parents[:2]:
        (folder / '__init__.py').touch()
    for name in MACHINERY:
        shutil.copy(SOURCES / f'{name}.py', place)
    (place / 'callee.py').write_text(CALLEE.format(1))
    (place / 'caller.py').write_text(CALLER)
    return place


def words(number, *others):
    """Return the words of a process that calls a kernel with a number; others: a disk to fill."""
    return [sys.executable, '-c', PROGRAM, json.dumps(number), *others]


def environment(package, **variables):
    """Return what a process of a package finds set; None: that a variable is not there."""
    usual = {'PYTHONPATH': str(package.parents[2]), 'PYTHONDONTWRITEBYTECODE': '1',
             'NUMBA_CACHE_DIR': None, 'XDG_CACHE_HOME': None}
    return {name: str(value) for name, value in {**os.environ, **usual, **variables}.items()
            if value is not None}


def run(package, number=0, before=(), **variables):
    """Return what the program tells: {name: value}."""
    done = subprocess.run([*before, *words(number)], capture_output=True, text=True,
                          env=environment(package, **variables), cwd=package.parents[2])
    assert (done.returncode, done.stderr) == (0, '')
    return json.loads(done.stdout)


def test_an_edited_kernel_is_new_in_those_that_call_it_and_the_former_is_kept(package, tmp_path):
    cache = tmp_path / 'cache'
    for added, hits in (1, 0), (9, 0), (1, 1):      # of one length, so that bytes must count
        (package / 'callee.py').write_text(CALLEE.format(added))
        told = run(package, NUMBA_CACHE_DIR=cache)
        assert Path(told.pop('folder')).parent == cache / 'fuzzy_stereo_ros'
        assert told == {'result': 2 * added, 'hits': hits, 'remarks': [], 'setting': str(cache)}


@pytest.mark.skipif(platform.machine() != 'x86_64', reason='names processors of x86-64')
def test_processors_share_a_folder_but_no_kernel_and_get_the_same_bits(package):
    for processor, hits in (('x86-64', 0), ('haswell', 0), ('x86-64', 1)):
        told = run(package, 0.1, NUMBA_CPU_NAME=processor, NUMBA_CPU_FEATURES='')
        assert (told['result'], told['hits']) == (2.1, hits)


@pytest.fixture
def strange_home(package, tmp_path):
    """Return the home of a user who can only read what root has compiled beside the code."""
    told = run(package)
    subprocess.run(['chmod', '-R', 'a+rX', tmp_path], check=True)
    home = tmp_path / 'home'
    home.mkdir(mode=0o777)
    home.chmod(0o777)
    return home, Path(told['folder'])


def test_what_another_user_compiled_beside_the_code_is_read_there_and_more_kept_in_the_users_cache(
        package, strange_home):
    home, compiled = strange_home
    told = run(package, before=as_stranger(), HOME=home)
    assert (told['result'], told['hits'], told['remarks']) == (2, 1, [])
    assert Path(told['folder']) == home / '.cache' / 'fuzzy_stereo_ros' / compiled.name
    assert [*Path(told['folder']).iterdir()] == []
    told = run(package, 0.5, before=as_stranger(), HOME=home)
    assert (told['result'], told['hits'], told['remarks']) == (2.5, 0, [])
    assert run(package, 0.5, before=as_stranger(), HOME=home)['hits'] == 1


@pytest.mark.parametrize('places, taken', [
    ({'HOME': '/home'}, '/home/.cache'), ({'HOME': '/home', 'XDG_CACHE_HOME': '/mine'}, '/mine'),
    ({'HOME': '/home', 'XDG_CACHE_HOME': 'not/absolute'}, '/home/.cache')])
def test_where_nothing_can_be_beside_the_code_the_users_cache_is_taken(
        package, tmp_path, monkeypatch, places, taken):
    monkeypatch.delenv('XDG_CACHE_HOME', raising=False)
    for name, place in places.items():
        monkeypatch.setenv(name, place.replace('/', f'{tmp_path}/', place[0] == '/'))
    monkeypatch.setattr(numba.config, 'CACHE_DIR', '')
    monkeypatch.setattr(compiled, 'SOURCES', package)
    (package / '__pycache__').write_text('no folder')
    folder, read, warning = compiled.choose_folders()
    assert (folder.parent, warning) == (Path(f'{tmp_path}{taken}', 'fuzzy_stereo_ros'), '')
    assert folder.is_dir() and read[-1] == folder


def test_a_folder_of_the_users_choice_that_cannot_be_is_told_with_the_one_taken(package):
    told = run(package, NUMBA_CACHE_DIR='/dev/null')
    assert told['result'] == 2
    assert told['remarks'] == [
        'compiled kernels cannot be kept in NUMBA_CACHE_DIR (/dev/null/fuzzy_stereo_ros: Not a '
        f"directory): they are kept in {package / '__pycache__'}"]


def test_a_disk_that_gets_full_is_told_once_and_kernels_are_kept_when_there_is_room(
        package, tmp_path):
    disk = tmp_path / 'disk'
    disk.mkdir()
    script = f'"$@" 0 {disk}/others && rm {disk}/others && "$@" 0 && "$@" 0'
    done = subprocess.run(
        [*mounting({disk: 'size=1m'}), 'sh', '-c', script, 'sh', *words(0)[:-1]],
        capture_output=True, text=True, env=environment(package, NUMBA_CACHE_DIR=disk), cwd=disk)
    assert (done.returncode, done.stderr) == (0, '')
    full, room, again = map(json.loads, done.stdout.splitlines())
    (remark,) = full['remarks']
    assert remark.startswith(f"compiled kernels can no longer be kept in {full['folder']}")
    assert '(No space left on device): ' in remark
    assert [(told['result'], told['hits']) for told in (full, room, again)] == [
        (2, 0), (2, 0), (2, 1)]
    assert room['remarks'] == again['remarks'] == []


def test_what_comes_back_damaged_is_compiled_and_kept_anew(package):
    first = run(package)
    assert Path(first['folder']).parent == package / '__pycache__'
    assert (first['hits'], first['remarks'], first['setting']) == (0, [], '')
    for suffix, content in ('nbc', b''), ('nbi', b'\x80\x04garbage'):
        for file in Path(first['folder']).glob(f'*.{suffix}'):
            file.write_bytes(content)
        assert run(package) == first
    assert run(package) == {**first, 'hits': 1}


@pytest.mark.skipif(not is_long(), reason='a race that is seldom lost: make fuzz')
def test_processes_that_start_at_once_do_not_break_one_another(package):
    results = {0: 2, 0.5: 2.5}
    started = [(number, subprocess.Popen(words(number), stdout=subprocess.PIPE,
                                         env=environment(package), cwd=package.parents[2]))
               for number in [*results] * 2]
    for number, one in started:
        told = json.loads(one.communicate()[0])
        assert (told['result'], told['remarks']) == (results[number], [])
    for number, result in results.items():
        told = run(package, number)
        assert (told['result'], told['hits']) == (result, 1)


def test_folders_not_used_for_long_are_removed_and_nothing_else(tmp_path, monkeypatch):
    monkeypatch.setattr(numba.config, 'CACHE_DIR', str(tmp_path))
    used = compiled.choose_folders()[0]
    others = [used.with_name(f'kernels_{number:016x}') for number in range(10)]
    foreign = used.with_name('unknown')
    for age, folder in enumerate([*others, foreign]):
        (folder / 'kernels').mkdir(parents=True)
        os.utime(folder, (age, age))
    os.utime(used, (0, 0))
    assert compiled.choose_folders()[0] == used
    assert {*used.parent.iterdir()} == {used, *others[-compiled.MOST_FOLDERS + 1:], foreign}


def test_all_kernels_are_compiled_by_one_module_and_depend_on_no_source_elsewhere():
    for source in SOURCES.rglob('*.py'):
        text = source.read_text(encoding='utf-8')
        assert ('njit' in text) == (source.stem == 'compiled'), source
        assert all(f'{name}.'.startswith('fuzzy_stereo_ros.matching.kernels.')
                   for name in re.findall(r'(?:from|import) +(fuzzy_stereo_ros\S*)', text)), source


def test_no_kernel_calls_another_one_as_only_machine_code_is_kept():
    for source in SOURCES.rglob('[!_]*.py'):
        import_module('.'.join(source.relative_to(SOURCES.parents[2]).with_suffix('').parts))
    assert len(compiled.kernels) > 100
    for kernel in compiled.kernels:
        functions = [kernel.py_func]
        for function in functions:      # and those that it calls
            found = [function.__globals__.get(name) for name in function.__code__.co_names]
            assert not any(isinstance(one, type(kernel)) for one in found), function.__name__
            functions += {one for one in found if isinstance(one, FunctionType)}.difference(
                functions)
