# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Each suite runs in its short form and fills its section of the page."""
import json
import re
import sys

from bench import datasets
from bench.__main__ import main, SUITES
from bench.page import check_page, HEADING, write_section
from fuzzy_stereo_ros.evaluation.report import Report
import pandas as pd
import pytest


# What is said of rows, and of columns, that hold random noise.
NOISE = re.compile(r'noise [1-9]|shot and read|sixth of the light|each part|Made|error, odd')
WORST = re.compile(r'\d \([+-]?\d')
OPTIONS = {'speed': ['--python', sys.executable]}


@pytest.mark.slow
@pytest.mark.parametrize('name', SUITES)
def test_a_suite_runs_in_its_short_form_and_fills_its_section(name, folder, monkeypatch, capsys):
    pytest.importorskip('matplotlib', reason='pictures need matplotlib')
    monkeypatch.delenv(datasets.DATA_VARIABLE, raising=False)
    assert main([name, '--quick', '--repeats', '1', '--json', '--output', 'page.md',
                 '--csv', 'figures', *OPTIONS.get(name, [])]) == 0
    (report,) = json.loads(capsys.readouterr().out)
    assert report['tables']
    for table in report['tables']:
        assert table['rows'], table['title']
        assert len(set(table['columns'])) == len(table['columns'])
        assert {len(row) for row in table['rows']} == {len(table['columns'])}
        for row in table['rows']:
            said = ' '.join(map(str, (table['title'], *table['columns'], *row)))
            assert any(isinstance(value, list) or WORST.search(str(value))
                       for value in row[1:]) == bool(NOISE.search(said)), said
    assert any(isinstance(value, list) or re.search(r'\d\.\d', str(value))
               for table in report['tables']
               for row in table['rows'] for value in row)
    for figures in (folder / 'figures').iterdir():
        assert figures.name.startswith(f'{name}_')
        assert len(pd.read_csv(figures)) > 1
    page = (folder / 'page.md').read_text()
    assert re.findall('<!-- begin of (.+) -->', page) == [report['name']]


def test_only_the_own_section_is_replaced_and_pictures_are_written_beside_the_page(tmp_path):
    page = tmp_path / 'page.md'
    for value, name in (('first', 'accuracy'), ('second', 'speed'), ('third', 'accuracy')):
        write_section(page, Report(name, name.title(), {'value': value}, [], [],
                                   {f'{name}.svg': b'<svg/>'}))
    text = page.read_text()
    assert text.startswith(HEADING)
    assert text.count('## Accuracy') == text.count('## Speed') == 1
    assert 'first' not in text
    assert text.index('third') < text.index('second')
    assert '![Accuracy](accuracy.svg)' in text
    assert (tmp_path / 'accuracy.svg').read_bytes() == b'<svg/>'


def test_a_file_that_is_no_page_of_benchmarks_is_not_written_to(tmp_path):
    other = tmp_path / 'other.md'
    other.write_text('# Mine\n')
    for path, reason in ((other, 'is no page of benchmarks'), (tmp_path / 'page.txt', 'suffix'),
                         (tmp_path / 'no' / 'page.md', 'no folder')):
        with pytest.raises(ValueError, match=reason):
            check_page(path)
