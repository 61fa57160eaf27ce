# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""How long a process needs before its first frame: with nothing compiled, and with a cache."""
import os
import subprocess
import sys
import tempfile
import time

from fuzzy_stereo_ros.evaluation.report import Table

IMPORT = 'from fuzzy_stereo_ros.matching import StereoMatcher'
WARM_UP = f'{IMPORT}; StereoMatcher().warm_up(480, 640)'


def compile_table():
    """Return the table of seconds until a new process could match its first frame."""
    with tempfile.TemporaryDirectory() as cache:
        rows = [('first ever: all kernels are compiled', process_seconds(WARM_UP, cache)),
                ('again: kernels come from the cache', process_seconds(WARM_UP, cache)),
                ('of these, Python and the import alone', process_seconds(IMPORT, cache))]
    return Table('Before the first frame, in a new process', ('', 'seconds'), rows,
                 'With profile realtime: grey and coloured images of 8 and of 16 bits.')


def process_seconds(program, cache):
    """Return how long a Python process takes for a program, its kernels kept in a folder."""
    begun = time.perf_counter()
    subprocess.run([sys.executable, '-c', program], check=True,
                   env={**os.environ, 'NUMBA_CACHE_DIR': cache})
    return time.perf_counter() - begun
