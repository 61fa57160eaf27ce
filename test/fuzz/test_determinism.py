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


def digests(threads, *options, **variables):
    """Return what the program prints, a line of profile, kind, frame and digest each."""
    done = subprocess.run([sys.executable, str(PROGRAM), f'--threads={threads}', *options],
                          capture_output=True, text=True, check=True,
                          env={**os.environ, **variables})
    lines = done.stdout.splitlines()
    assert len(set(lines)) == 33
    return lines


@pytest.fixture(scope='module')
def images(tmp_path_factory):
    """Return the option that has several processes read the same images."""
    return f"--images={tmp_path_factory.mktemp('images') / 'images.npz'}"


@pytest.fixture(scope='module')
def usual(images):
    """Return the digests with one thread and the usual cache of kernels."""
    return digests(1, images)


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
def test_opencv_and_numpy_for_an_older_processor_change_no_bit_of_realtime_and_of_paper_in_grey(
        usual, images):
    older = digests(2, images, OPENCV_CPU_DISABLE='AVX2,FMA3,FP16,AVX',
                    NPY_DISABLE_CPU_FEATURES='AVX2 FMA3')
    kept = 'realtime', 'paper, grey'
    assert [line for line in older if line.startswith(kept)] == [
        line for line in usual if line.startswith(kept)]
