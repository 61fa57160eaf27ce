# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""No kernel touches anything beside an array: pages are there; `make fuzz` checks indices, too."""
import re

from fuzzed import is_long
import pytest
from repository import ROOT, run_python

PROGRAM = str(ROOT / 'test' / 'support' / 'match_in_guarded_memory.py')
KINDS = '4' if is_long() else '1'       # of images
# Drawn sequences; pairs of quality take many times as long.
PROFILES = {'realtime': 20, 'fast': 20, 'quality': 8, 'paper': 20}
# Such kernels are kept in a folder of their own; LLVM need not work long on them.
CHECKED = {'NUMBA_BOUNDSCHECK': '1', 'NUMBA_OPT': '1'}
# The tests of kernels against their twins; those of whole matches are in the program's sizes.
KERNEL_TESTS = sorted(str(file) for file in (ROOT / 'test' / 'unit' / 'matching').glob('test_*.py')
                      if re.search('^(from|import) reference', file.read_text(encoding='utf-8'),
                                   re.MULTILINE))


# Kernels that check indices raise also where a wrong one stays within its array: as others compare
# them with their twins, that is left to `make fuzz`. It takes minutes to compile them.
@pytest.mark.timeout(1800)
@pytest.mark.parametrize('where, variables', [
    ('behind', {}), ('before', CHECKED if is_long() else {})])
def test_matching_touches_no_byte_beside_an_array(where, variables):
    done = run_python(PROGRAM, where, KINDS, *(
        f'{profile}:{200 if is_long() else drawn}' for profile, drawn in PROFILES.items()),
        **variables)
    assert done.returncode == 0, done.stdout + done.stderr[-2000:]
    lines = [line.split() for line in done.stdout.splitlines()]
    assert [profile for profile, *_ in lines] == [*PROFILES]
    for _, guarded, overwritten in lines:
        assert int(guarded) > 1000
        assert int(overwritten) == 0


@pytest.mark.skipif(not is_long(), reason='matches reach all kernels, which takes less: make fuzz')
def test_no_index_of_a_kernel_lies_outside_its_array_where_it_is_compared_with_its_twin():
    done = run_python('-m', 'pytest', '-q', '--timeout=3600', *KERNEL_TESTS, **CHECKED)
    assert done.returncode == 0, done.stdout[-3000:]


def test_only_a_constant_index_of_a_kernel_counts_from_the_end(tmp_path):
    done = run_python('-c', """
import numpy
from fuzzy_stereo_ros.matching.kernels.compiled import kernel
def last(array):
    return array[-1]
def any_one(array, at):
    return array[at]
last.__module__ = any_one.__module__ = 'fuzzy_stereo_ros.tried'
assert kernel(last)(numpy.arange(3)) == 2
kernel(any_one)(numpy.arange(3), -1)""", **CHECKED, NUMBA_CACHE_DIR=str(tmp_path))
    assert done.stderr.splitlines()[-1].startswith('IndexError: ')
