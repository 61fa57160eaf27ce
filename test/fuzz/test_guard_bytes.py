# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""No kernel touches a byte beside an array: explicit SIMD checks no bounds, so pages do."""
import signal
import subprocess
import sys

from fuzzed import is_long
import pytest
from repository import ROOT

PROGRAM = ROOT / 'test' / 'support' / 'match_in_guarded_memory.py'
KINDS = '4' if is_long() else '1'


def run(*arguments):
    return subprocess.run([sys.executable, str(PROGRAM), *arguments, KINDS],
                          capture_output=True, text=True)


@pytest.mark.parametrize('where', ['before', 'behind'])
@pytest.mark.parametrize('profile', ['realtime', 'quality', 'paper'])
def test_matching_touches_no_byte_beside_an_array(profile, where):
    done = run(where, profile)
    assert done.returncode == 0, done.stderr[-2000:]
    guarded, overwritten = map(int, done.stdout.split())
    assert guarded > 1000
    assert overwritten == 0


@pytest.mark.parametrize('where', ['before', 'behind'])
def test_a_vector_that_reaches_into_the_forbidden_page_ends_the_process(where):
    assert run(where, 'read').returncode == -signal.SIGSEGV


@pytest.mark.parametrize('where', ['before', 'behind'])
def test_a_byte_that_is_written_on_the_other_side_of_an_array_is_found(where):
    done = run(where, 'write')
    assert done.returncode == 0
    assert done.stdout.split()[1] == '1'
