# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""No kernel's index lies outside its array, checked by numba in kernels compiled for that."""
import os
import subprocess
import sys

from fuzzed import is_long
import pytest
from repository import ROOT

KINDS = '4' if is_long() else '1'       # of images
# The tests of kernels against their twins; those of whole matches are in the program's sizes.
KERNEL_TESTS = sorted(str(file) for file in (ROOT / 'test' / 'unit' / 'matching').glob('test_*.py')
                      if 'from reference' in file.read_text(encoding='utf-8'))


@pytest.fixture(scope='module')
def checked(tmp_path_factory):
    """Return an environment where kernels are compiled with checks, into a cache of its own."""
    # numba's cache does not know whether its kernels check: they must not meet the usual ones.
    return {**os.environ, 'NUMBA_BOUNDSCHECK': '1',
            'NUMBA_CACHE_DIR': str(tmp_path_factory.mktemp('checked_kernels'))}


def run(environment, *arguments):
    return subprocess.run([sys.executable, *arguments], capture_output=True, text=True,
                          env=environment, cwd=ROOT)


def test_an_index_beyond_an_array_is_found(checked):
    done = run(checked, '-c', 'import numba, numpy\n'
               'numba.njit(lambda array, at: array[at])(numpy.zeros(3), 3)')
    assert 'IndexError: index is out of bounds' in done.stderr


@pytest.mark.parametrize('profile', ['realtime', 'quality', 'paper'])
def test_no_index_of_a_match_lies_outside_its_array(checked, profile):
    program = ROOT / 'test' / 'support' / 'match_in_guarded_memory.py'
    done = run(checked, str(program), 'behind', profile, KINDS)
    assert done.returncode == 0, done.stderr[-2000:]


def test_no_index_of_a_kernel_lies_outside_its_array_where_it_is_compared_with_its_twin(checked):
    done = run(checked, '-m', 'pytest', '-q', '--timeout=3600', *KERNEL_TESTS)
    assert done.returncode == 0, done.stdout[-3000:]
