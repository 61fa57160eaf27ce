# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What is said of a process is what it did and what it holds."""
import os
import subprocess
import sys
import threading
import time

from fuzzy_stereo_ros.benchmarks.measured_process import MeasuredProcess
import pytest


@pytest.fixture
def process():
    """Return the MeasuredProcess of this process."""
    return MeasuredProcess(os.getpid())


def test_memory_is_what_is_filled_and_own_is_what_is_not_shared():
    # In a process of its own: here other tests' memory is freed meanwhile.
    script = (
        'import mmap, os\n'
        'from fuzzy_stereo_ros.benchmarks.measured_process import MeasuredProcess\n'
        'process = MeasuredProcess(os.getpid())\n'
        'before, own = process.megabytes(), process.own_megabytes()\n'
        'filled = mmap.mmap(-1, 50_000_000, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)\n'
        'filled.write(bytes([1]) * 1_000_000 * 50)\n'
        'print(process.megabytes() - before, process.own_megabytes() - own)\n'
        'shared = mmap.mmap(-1, 50_000_000)\n'      # by default shared with children
        'shared.write(filled[:])\n'
        'print(process.megabytes() - before, process.own_megabytes() - own)\n')
    printed = subprocess.run([sys.executable, '-c', script], capture_output=True, text=True,
                             check=True, timeout=60).stdout
    all_private, own_private, all_both, own_both = map(float, printed.split())
    assert 45 < all_private < 60
    assert 45 < own_private < 60
    assert 95 < all_both < 110
    assert 45 < own_both < 60


def test_work_is_that_of_all_threads_those_that_have_ended_too(process):
    def work():
        end = time.thread_time() + 0.2
        while time.thread_time() < end:
            pass

    before = process.seconds()
    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    work()
    assert 0.35 < process.seconds() - before < 2.0
