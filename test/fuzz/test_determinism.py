# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Equal input gives equal bits in every process: docs/architecture.md says how far that goes."""
import os
import platform
import subprocess
import sys

from fuzzed import is_long
import pytest
from repository import ROOT

PROGRAM = ROOT / 'test' / 'support' / 'match_digests.py'
LONG = pytest.mark.skipif(not is_long(), reason='compiling all kernels takes minutes: make fuzz')
X86 = pytest.mark.skipif(platform.machine() != 'x86_64', reason='names features of x86-64')


def digests(threads, **variables):
    """Return what the program prints with variables set, a line each of profiles and kinds."""
    done = subprocess.run([sys.executable, str(PROGRAM), str(threads)], capture_output=True,
                          text=True, check=True, env={**os.environ, **variables})
    lines = done.stdout.splitlines()
    assert len(set(lines)) == 6
    return lines


@pytest.fixture(scope='module')
def usual():
    """Return the digests with one thread and the usual cache of kernels."""
    return digests(1)


def test_several_processes_and_threads_give_the_same_bits(usual):
    for threads in (2, 3):      # a race does not show each time
        assert digests(threads) == usual


@LONG
def test_a_cold_cache_gives_the_bits_of_a_warm_one(usual, tmp_path):
    cold, warm = (digests(2, NUMBA_CACHE_DIR=str(tmp_path)) for _ in range(2))
    assert cold == warm == usual


@LONG
@X86
def test_kernels_for_the_least_processor_give_the_same_bits(usual, tmp_path):
    assert digests(2, NUMBA_CACHE_DIR=str(tmp_path), NUMBA_CPU_NAME='x86-64',
                   NUMBA_CPU_FEATURES='') == usual


@X86
def test_opencv_and_numpy_for_an_older_processor_change_no_bit_but_of_quality(usual):
    older = digests(2, OPENCV_CPU_DISABLE='AVX2,FMA3,FP16,AVX',
                    NPY_DISABLE_CPU_FEATURES='AVX2 FMA3')
    assert [line for line in older if not line.startswith('quality')] == [
        line for line in usual if not line.startswith('quality')]
