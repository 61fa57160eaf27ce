# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the README and the architecture page say exists, and is what the code says."""
import re

from bench.demo.phase import Phase, table
from bench.page import QUOTE, requoted
from fuzzy_stereo_ros.parameters.page import renewed
from pages import ROOT, text_of
import pytest

README = text_of('README.md')
PARAMETERS, NODE = (text_of(f'docs/{name}.md') for name in ('parameters', 'node'))
ARCHITECTURE, ALGORITHM, FIGURES = (
    text_of(f'docs/{name}.md') for name in ('architecture', 'algorithm', 'benchmarks'))


def cells(line):
    return [cell.strip() for cell in line.strip('|').split('|')]


def test_the_parameter_tables_are_those_of_the_declaration():
    assert renewed(PARAMETERS) == PARAMETERS, \
        'renew them: python -m fuzzy_stereo_ros.parameters.page docs/parameters.md'


def test_the_demo_table_has_the_rows_and_columns_that_the_demo_prints():
    found = re.search('<!-- demo: begin -->\n(.*?)\n<!-- demo: end -->', README, re.DOTALL)[1]
    written, printed = (
        [cells(line) for line in text.splitlines() if '---' not in line]
        for text in (found, table([Phase('warm'), Phase('cold')])))
    assert written[0] == printed[0]
    assert [row[0] for row in written] == [row[0] for row in printed]


def test_the_readme_is_a_screen_to_running_and_then_links():
    assert len(README.splitlines()) <= 120


@pytest.mark.parametrize('page', [README, ALGORITHM], ids=['README.md', 'algorithm.md'])
def test_a_page_quotes_the_page_of_benchmarks(page):
    assert len(QUOTE.findall(page)) == page.count('<!-- quote ') > 0
    assert requoted(page, FIGURES) == page, \
        'renew them: python -m bench.page README.md docs/algorithm.md'


def test_the_executable_and_the_dds_profile_that_are_named_exist():
    package, executable = re.search(r"package='(\w+)', executable='(\w+)'", README).groups()
    assert package == 'fuzzy_stereo_ros'
    assert f'{executable} = ' in (ROOT / 'setup.py').read_text(encoding='utf-8')
    assert 'config/fastdds.xml' in NODE and (ROOT / 'config' / 'fastdds.xml').exists()


def test_every_module_that_the_pages_name_exists():
    package = ROOT / 'fuzzy_stereo_ros'
    modules = {file.relative_to(root).as_posix() for root, files in (
        (package, package.rglob('*.py')), (ROOT, ROOT.glob('bench/**/*.py'))) for file in files}
    short = {name.split('/')[-1] for name in modules}
    for named in re.findall(r'[\w/]+\.py\b', ARCHITECTURE + ALGORITHM):
        if not named.startswith('test/'):
            assert named in (modules if '/' in named else short), named


def test_every_flat_file_stands_in_the_architecture():
    for file in (ROOT / 'fuzzy_stereo_ros').glob('*.py'):
        assert file.name == '__init__.py' or f'`{file.name}`' in ARCHITECTURE, file.name
