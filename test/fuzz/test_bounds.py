# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""No kernel touches anything beside an array: numba checks indices, pages what SIMD reaches."""
import os
import re
import subprocess
import sys

from fuzzed import is_long
import pytest
from repository import ROOT

PROGRAM = str(ROOT / 'test' / 'support' / 'match_in_guarded_memory.py')
KINDS = ('4', '200') if is_long() else ('1', '20')      # of images; drawn sequences
PROFILES = 'realtime', 'fast', 'quality', 'paper'
# The tests of kernels against their twins; those of whole matches are in the program's sizes.
KERNEL_TESTS = sorted(str(file) for file in (ROOT / 'test' / 'unit' / 'matching').glob('test_*.py')
                      if re.search('^(from|import) reference', file.read_text(encoding='utf-8'),
                                   re.MULTILINE))


def run(*arguments, **variables):
    """Run Python with arguments and variables of the environment; return what came of it."""
    return subprocess.run([sys.executable, *arguments], capture_output=True, text=True, cwd=ROOT,
                          env={**os.environ, **variables})


# ---- SIMD: a page that nobody may touch ----


@pytest.mark.parametrize('where', ['before', 'behind'])
def test_matching_touches_no_byte_beside_an_array(where):
    done = run(PROGRAM, where, *KINDS, *PROFILES)
    assert done.returncode == 0, done.stdout + done.stderr[-2000:]
    lines = [line.split() for line in done.stdout.splitlines()]
    assert [profile for profile, *_ in lines] == [*PROFILES]
    for _, guarded, overwritten in lines:
        assert int(guarded) > 1000
        assert int(overwritten) == 0


# ---- indices: kernels compiled to check them ----


@pytest.fixture(scope='module')
def checked(tmp_path_factory):
    """Return variables with which kernels are compiled with checks, into a cache of their own."""
    # numba's cache does not know whether its kernels check: they must not meet the usual ones.
    return {'NUMBA_BOUNDSCHECK': '1',
            'NUMBA_CACHE_DIR': str(tmp_path_factory.mktemp('checked_kernels'))}


@pytest.mark.parametrize('index, error', [('-1', ''), ('at', 'IndexError')])
def test_only_a_constant_index_of_a_kernel_counts_from_the_end(checked, index, error):
    done = run('-c', f"""
import numpy
from fuzzy_stereo_ros.matching.kernels.compiled import kernel
def read(array, at):
    return array[{index}]
read.__module__ = 'fuzzy_stereo_ros.{index}'
assert kernel(read)(numpy.arange(3), -1) == 2""", **checked)
    assert done.returncode == bool(error) and error in done.stderr


@pytest.mark.parametrize('profile', PROFILES)
def test_no_index_of_a_match_lies_outside_its_array(checked, profile):
    done = run(PROGRAM, 'behind', *KINDS, profile, **checked)
    assert done.returncode == 0, done.stderr[-2000:]


def test_no_index_of_a_kernel_lies_outside_its_array_where_it_is_compared_with_its_twin(checked):
    done = run('-m', 'pytest', '-q', '--timeout=3600', *KERNEL_TESTS, **checked)
    assert done.returncode == 0, done.stdout[-3000:]
