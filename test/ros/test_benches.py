# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The demo, the benchmark beside a camera and a soak, in short runs with the real node."""
import os
import re

from bench.soak.events import KINDS
from fuzzy_stereo_ros.pairs.image_files import read_image
from node_process import START
import pytest
from repository import printed_by, ROOT


@pytest.mark.timeout(700)       # the first start on a machine compiles
def test_the_demo_prints_the_table_of_the_real_node_and_writes_the_picture(ros, tmp_path):
    printed = printed_by('-m', 'bench.demo', '--frames', 4, '--rate', 5, '--picture', 'seen.png',
                         folder=tmp_path, PYTHONPATH=str(ROOT))
    cells = [[cell.strip() for cell in line.strip('|').split('|')]
             for line in printed.splitlines() if line.startswith('|')]
    rows = {name: figures for name, *figures in cells}
    assert rows[''] == ['warm', 'cold']
    assert rows['pairs published'] == ['4', '4']
    assert rows['pairs lost'] == ['0', '0']
    for column in (0, 1):
        received, dropped = (int(rows[name][column]) for name in (
            'disparity images received', 'pairs dropped and counted by the node'))
        assert received + dropped == 4 and received > 0
        assert float(rows['density [%]'][column]) > 80
        assert float(rows['bad-1, of the published disparities [%]'][column]) < 8
        assert float(rows['latency, median [ms]'][column]) > 1
    assert f'\npicture: {tmp_path}/seen.png\n' in printed
    assert read_image(tmp_path / 'seen.png').shape[1] > 1000
    assert os.listdir(tmp_path) == ['seen.png']


@pytest.mark.alone
@pytest.mark.timeout(4 * START)
def test_a_short_run_writes_its_section_and_every_pair_is_accounted_for(ros, tmp_path):
    page = tmp_path / 'page.md'
    printed = printed_by('-m', 'bench.live', '--seconds', 0.2, '--repeats', 1, '--case',
                         '160x120x16', '--output', page)
    written = page.read_text(encoding='utf-8')
    assert '## The node beside a camera' in printed
    rows = re.findall(r'^\| 160x120, 16 disparities *\|(.+)\|$', written, re.MULTILINE)
    (row,) = rows
    pairs, matched, dropped, rejected, rate, median, high, *_ = map(float, row.split('|'))
    assert matched > 0 and rate > 0 and rejected == 0
    assert abs(pairs - matched - dropped) <= 2      # one waits and one is matched at the end
    assert 0 < median <= high
    assert re.search(r'^\| 60 pairs/s: ratio *\|', written, re.MULTILINE)


# Three rounds do not level what is kept for the next message, nor what other programs take.
# With the seed the profile that takes long comes last.
SHORT = ('--minutes=0', '--seed=91', '--rows=180', '--columns=240', '--disparities=16',
         '--between=0.1', '--work=400', '--memory=2', '--resident=15', '--verbose')


@pytest.mark.alone
@pytest.mark.timeout(2 * START)
def test_in_a_short_soak_every_promise_is_kept(ros):
    printed = printed_by('-m', 'bench.soak', *SHORT, PYTHONPATH=str(ROOT / 'test' / 'support'))
    assert all(f': {kind} ' in printed for kind in KINDS)
    assert printed.count('kept: ') == 8 and 'BROKEN' not in printed
