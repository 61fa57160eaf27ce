# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Every promise is kept in a short soak."""
import os
import subprocess
import sys

from node_process import ROOT, START
import pytest
from soak_script import KINDS

SHORT = ('--minutes', '0', '--rows', '240', '--columns', '320', '--disparities', '16',
         '--between', '0.1')
# Three rounds do not level what is kept for the next message, nor what other programs take.
PATIENT = '--work', '400', '--memory', '2', '--resident', '15'


@pytest.mark.alone
@pytest.mark.timeout(2 * START)
def test_in_a_short_soak_every_promise_is_kept(ros, tmp_path):
    log = tmp_path / 'node.log'
    done = subprocess.run(
        [sys.executable, '-m', 'soak', *SHORT, *PATIENT, '--verbose', '--log', str(log)],
        cwd=ROOT, capture_output=True,
        env={**os.environ, 'PYTHONPATH': os.pathsep.join(
            str(ROOT / 'test' / folder) for folder in ('soak', 'support'))},
        text=True, check=False)
    assert done.returncode == 0, f'{done.stdout}{done.stderr}'
    assert all(f': {kind} ' in done.stdout for kind in KINDS)
    assert done.stdout.count('kept: ') == 8
    assert 'BROKEN' not in done.stdout
    assert 'ready: the kernels are warm' in log.read_text(encoding='utf-8')
