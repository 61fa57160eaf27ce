# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What is said of a process is what it did and what it holds."""
import mmap
import os
import threading
import time

from fuzzy_stereo_ros.measured_process import MeasuredProcess
import numpy as np
import pytest


@pytest.fixture
def process():
    """Return the MeasuredProcess of this process."""
    return MeasuredProcess(os.getpid())


def test_memory_is_what_is_filled_and_own_is_what_is_not_shared(process):
    before, own = process.megabytes(), process.own_megabytes()
    filled = np.ones(50_000_000, np.uint8)
    assert 45 < process.megabytes() - before < 60
    assert 45 < process.own_megabytes() - own < 60, filled.size
    with mmap.mmap(-1, 50_000_000) as shared:       # by default shared with children
        shared.write(filled)
        assert 95 < process.megabytes() - before < 110
        assert 45 < process.own_megabytes() - own < 60


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
