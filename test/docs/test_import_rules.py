# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Who may import whom: the table of rooms, read from the source and not from what runs."""
import ast
from pathlib import PurePosixPath
import re
import sys
from typing import NamedTuple

import pytest
from repository import ROOT

PACKAGE, BENCH = 'fuzzy_stereo_ros', 'bench'
LONGEST_MODULE = 400
SPDX_LINES = ('# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers',
              '# SPDX-License-Identifier: Apache-2.0')
ROS_MODULE = re.compile(r'(rcl|ros|rmw|launch|ament_|tf2|message_filters|cv_bridge|builtin_inter)'
                        r'|\w+_(msgs|srvs)$')
# Files that import ROS, or stand on those that do: nobody else imports them.
ROS_FILES = 'node', 'bench/demo', 'bench/live', 'bench/soak/stage'
INSIDE_FUNCTIONS = frozenset({'argcomplete', 'av', 'dask', 'distributed', 'jinja2', 'matplotlib',
                              'pandas', 'rosbags', 'yaml'})


class Room(NamedTuple):
    """What a room may import; project: rooms, and modules of rooms, above it in the table."""

    project: tuple
    libraries: frozenset = frozenset({'cv2', 'numpy'})
    libraries_inside_functions: frozenset = frozenset()
    ros: bool = False


# From the bottom to the top: a room imports itself and what stands above it in this table.
ROOMS = {
    'matching/kernels/simd': Room(('matching',), frozenset({'llvmlite', 'numba', 'numpy'})),
    'matching': Room((), frozenset({'cv2', 'numba', 'numpy'})),
    'pairs': Room(('matching/match',), libraries_inside_functions=frozenset({'yaml'})),
    'bags': Room(('pairs',), libraries_inside_functions=frozenset({'rosbags', 'yaml'})),
    'evaluation': Room(('matching', 'pairs'), frozenset({'cv2', 'numpy', 'pandas'}),
                       frozenset({'jinja2', 'skimage'})),
    'views': Room(('evaluation/scores', 'matching', 'pairs'),
                  libraries_inside_functions=INSIDE_FUNCTIONS),
    'parameters': Room(('matching', 'pairs')),
    'flat': Room(('matching', 'pairs', 'parameters'),
                 frozenset({'cv2', 'numba', 'numpy', 'tqdm'})),
    'replay': Room(('bags', 'flat', 'matching', 'pairs', 'parameters', 'views'),
                   libraries_inside_functions=INSIDE_FUNCTIONS),
    'synthetic': Room(('pairs', 'parameters')),
    'commands': Room(('bags', 'evaluation', 'flat', 'matching', 'pairs',
                      'parameters', 'replay', 'synthetic', 'views'),
                     libraries_inside_functions=INSIDE_FUNCTIONS),
    'node': Room(('flat', 'matching', 'pairs', 'parameters', 'synthetic'),
                 frozenset({'cv2', 'numpy', 'yaml'}), ros=True),
    'bench': Room(('commands', 'evaluation', 'flat', 'matching', 'pairs', 'parameters',
                   'synthetic', 'views'), frozenset({'cv2', 'numpy', 'pandas'}),
                  frozenset({'PIL', 'matplotlib', 'skimage'})),
    'bench/demo': Room(('bench/datasets', 'evaluation', 'flat', 'matching', 'node', 'pairs',
                        'parameters', 'views'), frozenset({'cv2', 'numpy', 'tqdm'}),
                       frozenset({'matplotlib'}), ros=True),
    'bench/live': Room(('bench', 'evaluation', 'flat', 'node', 'pairs'),
                       frozenset({'cv2', 'numpy', 'psutil', 'tqdm'}), ros=True),
    # Its node and cameras are those of the tests, which test/support starts.
    'bench/soak': Room(('node', 'pairs'), frozenset({
        'made_scenes', 'node_process', 'numpy', 'psutil', 'ros_bench'}), ros=True),
}
# Folders of kernels, from the bottom to the top: as in ROOMS. What is in none is below all.
KERNELS = 'possibility', 'scanlines', 'refinement', 'temporal', 'genetic', 'planes'


def name_of_room(path):
    """Return the name of the room that a file of the project belongs to, as in ROOMS."""
    place = PurePosixPath(path).with_suffix('').as_posix().removeprefix(f'{PACKAGE}/')
    within = [room for room in ROOMS if place == room or place.startswith(f'{room}/')]
    return max(within, key=len) if within else 'flat'


def imports_of(tree):
    """Return (line, full name, is it inside a function) for each import."""
    found = []

    def visit(node, inside):
        inside = inside or isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda))
        if isinstance(node, ast.Import):
            found.extend((node.lineno, alias.name, inside) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            start = 'a relative ' * bool(node.level) + (node.module or 'name')
            found.extend((node.lineno, f'{start}.{alias.name}', inside) for alias in node.names)
        for child in ast.iter_child_nodes(node):
            visit(child, inside)

    visit(tree, False)
    return found


def why_rejected(room_name, name, inside):
    """Return what is wrong with importing a name in a room, or None."""
    room = ROOMS[room_name]
    top, *below = name.split('.')
    if top in (PACKAGE, BENCH):
        place = '/'.join(below if top == PACKAGE else (top, *below))
        flat = top == PACKAGE and (
            len(below) < 2 or (ROOT / PACKAGE / f'{below[0]}.py').exists())
        allowed = (room_name, *room.project)
        if place not in ('', '__version__') and not (flat and 'flat' in allowed) and not any(
                f'{place}/'.startswith(f'{other}/') for other in allowed):
            return f'imports {name}: outside its room'
        if not room.ros and f'{place}/'.startswith(tuple(f'{file}/' for file in ROS_FILES)):
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
    if PurePosixPath(path).parts[0] not in (PACKAGE, BENCH):
        return found
    if len(lines) > LONGEST_MODULE:
        found.append(f'{path}:{LONGEST_MODULE}: has {len(lines)} lines, '
                     f'{LONGEST_MODULE} are allowed')
    room = name_of_room(path)
    for line, name, inside in imports_of(ast.parse(source)):
        reason = why_rejected(room, name, inside)
        if reason:
            found.append(f'{path}:{line}: {reason}')
    return found


def test_every_source_file_keeps_the_rules():
    folders = (PACKAGE, BENCH, 'docs', 'launch', 'test')
    files = [*ROOT.glob('*.py'), *(file for name in folders
                                   for file in (ROOT / name).rglob('*.py'))]
    assert [breach for file in files for breach in breaches(
        file.relative_to(ROOT).as_posix(), file.read_text(encoding='utf-8'))] == []


@pytest.mark.parametrize('folder', ['', *KERNELS])
def test_kernels_import_no_folder_of_kernels_that_stands_below_theirs(folder):
    kernels = PurePosixPath(PACKAGE, 'matching', 'kernels')
    below = KERNELS[KERNELS.index(folder) + 1:] if folder else KERNELS
    files = sorted((ROOT / kernels / folder).glob('*.py'))
    assert files
    for file in files:
        path = kernels / folder / file.name
        for line, name, _ in imports_of(ast.parse(file.read_text(encoding='utf-8'))):
            assert not name.startswith(tuple(f'{PACKAGE}.matching.kernels.{other}.'
                                             for other in below)), f'{path}:{line}: {name}'
