# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The node beside a camera, in a short run of the real benchmark."""
import re
import subprocess
import sys

from node_process import START
import pytest
from repository import ROOT

MODULE = 'bench.live'


@pytest.mark.alone
@pytest.mark.timeout(4 * START)
def test_a_short_run_writes_its_section_and_every_pair_is_accounted_for(ros, tmp_path):
    page = tmp_path / 'page.md'
    done = subprocess.run(
        [sys.executable, '-m', MODULE, '--seconds', '1', '--frames', '50',
         '--case', '320x240x32', '--case', '160x120x16', '--output', str(page)],
        capture_output=True, text=True, check=False, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    written = page.read_text(encoding='utf-8')
    assert '## The node beside a camera' in done.stdout
    for case in ('320x240, 32 disparities', '160x120, 16 disparities'):
        rows = re.findall(rf'^\| {case} *\|(.+)\|$', written, re.MULTILINE)
        assert len(rows) == 2       # of realtime and of paper_live
        for row in rows:
            pairs, matched, dropped, rejected, rate, median, high, *_ = map(float, row.split('|'))
            assert matched > 0 and rate > 0 and rejected == 0
            assert abs(pairs - matched - dropped) <= 2  # one waits and one is matched at the end
            assert 0 < median <= high
    memory = re.findall(r'^\| (\d+) +\| +([\d.]+) \|$', written, re.MULTILINE)
    assert int(memory[-1][0]) >= 50 and float(memory[-1][1]) > 50


@pytest.mark.parametrize('arguments, sentence', [
    (('--output', 'page.txt'), 'a page of benchmarks has .md'),
    (('--seconds', '0'), '--seconds is 0.0; allowed are numbers above 0')])
def test_bad_arguments_end_with_one_sentence_and_code_2(ros, arguments, sentence):
    done = subprocess.run([sys.executable, '-m', MODULE, *arguments],
                          capture_output=True, text=True, check=False, cwd=ROOT)
    assert done.returncode == 2
    assert sentence in done.stderr
    assert 'Traceback' not in done.stderr
