# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A page of benchmarks has a section a suite, and nothing else is written to."""
from bench.page import check_page, HEADING, write_section
from fuzzy_stereo_ros.evaluation.report import Report
import pytest


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
