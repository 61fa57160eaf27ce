# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Compiled kernels are kept where it is possible, used only where they fit, and nothing breaks."""
import json
import os
from pathlib import Path
import platform
import re
import shutil
import subprocess
import sys

import fuzzy_stereo_ros.matching.kernels as kernels
from fuzzy_stereo_ros.matching.kernels import compiled
from mounted import as_stranger, mounting, READ_ONLY
import numba
import pytest

SOURCES = Path(kernels.__file__).parent
START = """# a kernel
from fuzzy_stereo_ros.matching.kernels.compiled import inlined, kernel
"""
CALLEE = START + """

@inlined
def step(number):
    return number + {}
"""
CALLER = START + """from fuzzy_stereo_ros.matching.kernels.callee import step


@kernel
def steps(number):
    return step(step(number))
"""
PROGRAM = """
import json, sys
from fuzzy_stereo_ros.matching.kernels.caller import steps
from fuzzy_stereo_ros.matching.kernels.compiled import FOLDER, remarks
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
                  'remarks': told + remarks()}))
"""


@pytest.fixture
def package(tmp_path):
    """Return the folder of kernels of a copy of the package that has two of them."""
    place = tmp_path / 'code' / 'fuzzy_stereo_ros' / 'matching' / 'kernels'
    place.mkdir(parents=True)
    for folder in place.parents[:2]:
        (folder / '__init__.py').touch()
    for name in ('__init__', 'compiled'):
        shutil.copy(SOURCES / f'{name}.py', place)
    (place / 'callee.py').write_text(CALLEE.format(1))
    (place / 'caller.py').write_text(CALLER)
    return place


@pytest.fixture
def closed(package):
    """Return a package beside whose code nothing can be kept."""
    (package / '__pycache__').write_text('no folder')
    return package


def started(package, number=0, *others, before=(), **variables):
    """Start a process that calls a kernel with a number; others: the file of a disk to fill."""
    environment = {'HOME': package.parents[3] / 'home', 'PYTHONPATH': package.parents[2],
                   'PATH': os.environ['PATH'], 'PYTHONDONTWRITEBYTECODE': '1', **variables}
    return subprocess.Popen(
        [*before, sys.executable, '-c', PROGRAM, json.dumps(number), *others],
        stdout=subprocess.PIPE, cwd=package.parents[2],
        env={name: str(value) for name, value in environment.items() if value is not None})


def run(package, *arguments, **options):
    """Return what a process tells, as `started`."""
    process = started(package, *arguments, **options)
    printed = process.communicate()[0]
    assert process.returncode == 0
    return json.loads(printed)


def result(told):
    return told['result'], told['hits'], told['remarks']


def test_kernels_are_kept_beside_the_code_and_loaded_whatever_the_times_of_its_files(package):
    first = run(package)
    assert result(first) == (2, 0, [])
    for source in package.glob('*.py'):     # as an image of a container changes them
        os.utime(source, (1, 1))
    assert run(package) == {**first, 'hits': 1}
    assert Path(first['folder']).parent == package / '__pycache__'


def test_an_edited_kernel_is_new_in_those_that_call_it_and_the_former_is_kept(package):
    assert run(package)['result'] == 2
    (package / 'callee.py').write_text(CALLEE.format(10))
    assert run(package)['result'] == 20
    (package / 'callee.py').write_text(CALLEE.format(1))
    assert result(run(package)) == (2, 1, [])


@pytest.mark.skipif(platform.machine() != 'x86_64', reason='names processors of x86-64')
def test_processors_share_a_folder_but_no_kernel_and_get_the_same_bits(package):
    for processor, hits in (('x86-64', 0), ('haswell', 0), ('x86-64', 1), ('haswell', 1)):
        told = run(package, 0.1, NUMBA_CPU_NAME=processor, NUMBA_CPU_FEATURES='')
        assert (told['result'], told['hits']) == (2.1, hits)


def test_a_user_reads_what_root_compiled_beside_the_code_and_keeps_more_in_the_own_cache(
        package, tmp_path):
    folder = Path(run(package)['folder'])
    subprocess.run(['chmod', '-R', 'a+rX', tmp_path], check=True)
    home = tmp_path / 'home'
    home.mkdir()
    home.chmod(0o777)
    own = home / '.cache' / 'fuzzy_stereo_ros' / folder.name
    for number, hits, kept in ((0, 1, 0), (0.5, 0, 2), (0.5, 1, 2)):
        told = run(package, number, before=as_stranger(), HOME=home)
        assert result(told) == (2 + number, hits, [])
        assert (told['folder'], len([*own.iterdir()])) == (str(own), kept)
    assert result(run(package, before=as_stranger(), HOME='/dev/null')) == (2, 1, [])


@pytest.mark.parametrize('variable', ['HOME', 'NUMBA_CACHE_DIR', 'XDG_CACHE_HOME'])
def test_where_nothing_can_be_beside_the_code_another_folder_is_taken(closed, tmp_path, variable):
    told = run(closed, **{variable: tmp_path / 'user'})
    (cache,) = (tmp_path / 'user').rglob('fuzzy_stereo_ros')
    assert (Path(told['folder']).parent, told['remarks']) == (cache, [])


def test_a_folder_of_the_users_choice_that_cannot_be_is_told_with_the_one_taken(package):
    assert run(package, NUMBA_CACHE_DIR='/dev/null')['remarks'] == [
        'compiled kernels cannot be kept in NUMBA_CACHE_DIR (/dev/null/fuzzy_stereo_ros: Not a '
        f"directory): they are kept in {package / '__pycache__'}"]


@pytest.mark.parametrize('kind, reason', [
    (None, 'Not a directory'), ('stranger', 'Permission denied'),
    (READ_ONLY, 'Read-only file system')])
def test_without_a_folder_it_works_and_says_so_once(closed, tmp_path, kind, reason):
    home = tmp_path / 'home'
    before = ()
    if kind is None:
        home = Path('/dev/null')
    else:
        home.mkdir()
        subprocess.run(['chmod', '-R', 'a+rX', tmp_path], check=True)
        before = as_stranger() if kind == 'stranger' else mounting({home: kind})
    told = run(closed, before=before, HOME=home)
    assert (told['folder'], *result(told)) == ('None', 2, 0, [
        f'no folder for compiled kernels can be written to ({closed}/__pycache__: Not a '
        f'directory, {home}/.cache/fuzzy_stereo_ros: {reason}): they are compiled at each start, '
        'which takes up to 60 s; set NUMBA_CACHE_DIR to a folder that can be'])


def test_a_user_without_home_and_name_has_no_cache_and_no_folder_called_tilde(closed, tmp_path):
    subprocess.run(['chmod', '-R', 'a+rX', tmp_path], check=True)
    here = tmp_path / 'here'
    here.mkdir()
    here.chmod(0o777)
    told = run(closed, before=[*as_stranger(), 'env', '-C', str(here)], HOME=None)
    assert told['folder'] == 'None'
    assert f'({closed}/__pycache__: Not a directory)' in told['remarks'][0]
    assert [*here.iterdir()] == []


def test_a_disk_that_is_full_is_told_once_and_kernels_are_kept_when_there_is_room(
        package, tmp_path):
    disk = tmp_path / 'disk'
    disk.mkdir()
    others = f'{disk}/others'
    # the first process fills the disk; the others find room
    words = [*mounting({disk: 'size=1m'}), 'sh', '-c',
             f'"$@" {others} && rm {others} && "$@" && "$@"', 'sh']
    process = started(package, before=words, NUMBA_CACHE_DIR=disk)
    full, room, again = map(json.loads, process.communicate()[0].splitlines())
    (remark,) = full.pop('remarks')
    assert remark.startswith(
        f"compiled kernels can no longer be kept in {full['folder']} (No space left on device): ")
    assert result(room) == (2, 0, [])
    assert result(again) == (2, 1, [])


def test_what_comes_back_damaged_is_compiled_and_kept_anew(package):
    folder = Path(run(package)['folder'])
    for content in (b'', b'\x80\x04garbage'):
        for file in folder.iterdir():
            file.write_bytes(content)
        assert result(run(package)) == (2, 0, [])
    assert run(package)['hits'] == 1


def test_processes_that_compile_signatures_of_a_kernel_at_once_keep_each_its_own(package):
    numbers = [0, 0.5] * 2
    processes = [started(package, number) for number in numbers]
    for number, process in zip(numbers, processes):
        told = json.loads(process.communicate()[0])
        assert (told['result'], told['remarks']) == (2 + number, [])
    for number in numbers[:2]:
        assert result(run(package, number)) == (2 + number, 1, [])


def test_kernels_with_checked_bounds_and_without_are_kept_apart(monkeypatch):
    names = {compiled.folder_name()}
    monkeypatch.setattr(numba.config, 'BOUNDSCHECK', 1)
    assert compiled.folder_name() not in names


@pytest.mark.parametrize('allocates', [False, True])
def test_only_kernels_that_make_arrays_count_who_uses_one(allocates):
    def second(numbers):
        rest = numbers[1:]
        return rest[0]
    dispatcher = compiled._compiled(second, _nrt=allocates)
    dispatcher.compile((numba.uint8[::1],))
    [code] = dispatcher.inspect_llvm().values()
    assert ('NRT_' in code) == allocates


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
    assert {*used.parent.iterdir()} == {used, *others[-compiled.KEPT + 1:], foreign}


def test_all_kernels_are_compiled_by_one_module_and_depend_on_no_source_elsewhere():
    for source in SOURCES.rglob('*.py'):
        text = source.read_text(encoding='utf-8')
        assert ('njit' in text) == (source.stem == 'compiled'), source
        assert all(f'{name}.'.startswith('fuzzy_stereo_ros.matching.kernels.')
                   for name in re.findall(r'(?:from|import) +(fuzzy_stereo_ros\S*)', text)), source
