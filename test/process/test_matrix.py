# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""`make matrix` tries the oldest versions that the package says it runs on, and the newest."""
import ast

from packaging.requirements import Requirement
from packaging.version import Version
from pages import text_of
import pytest

tomllib = pytest.importorskip('tomllib', reason='comes with Python 3.11')
MATRIX = tomllib.loads(text_of('pyproject.toml'))['tool']['tox']


def said_in_setup(name):
    """Return what setup.py gives for a keyword."""
    return next(ast.literal_eval(node.value) for node in ast.walk(ast.parse(text_of('setup.py')))
                if isinstance(node, ast.keyword) and node.arg == name)


def test_the_oldest_python_of_the_matrix_is_the_oldest_that_is_allowed():
    pythons = [Version(name) for name in MATRIX['env_list'] if '-' not in name]
    assert said_in_setup('python_requires') == f'>={min(pythons)}'


@pytest.mark.parametrize('name', ['3.11-jazzy', '3.12-jazzy'])
def test_what_jazzy_has_is_within_the_bounds_and_the_oldest_of_it_at_them(name):
    allowed = {one.name: one.specifier
               for one in map(Requirement, said_in_setup('install_requires'))}
    tried = {one.name: next(iter(one.specifier)).version
             for one in map(Requirement, MATRIX['env'][name]['deps'])}
    assert len(tried) == 3
    for library, version in tried.items():
        assert version in allowed[library]
        least = next(one.version for one in allowed[library] if one.operator == '>=')
        assert library == 'numba' and name == '3.12-jazzy' or version.startswith(f'{least}.')
