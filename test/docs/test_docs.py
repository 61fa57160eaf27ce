# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Links of the pages lead on, and their tables and names are those of the code."""
import ast
from functools import cache
import re
import subprocess
import sys

from bench.page import QUOTE, requoted
from bench.parameter_pages import renewed
from pages import FENCE, ROOT, said, text_of
import pytest


SKIPPED = {'build', 'dist', 'install', 'log', 'test'}
PAGES = sorted(path.relative_to(ROOT).as_posix()
               for suffix in ('md', 'rst') for path in ROOT.rglob(f'*.{suffix}')
               if not any(part.startswith(('.', '_')) or part in SKIPPED
                          for part in path.relative_to(ROOT).parts))
OUTSIDE = re.compile(r'(https?|mailto):')


def anchors(text):
    """Return the anchors of a page's headings, as GitHub and MyST make them."""
    found, taken = [], {}
    for title in re.findall(r'^#+ (.+)$', FENCE.sub('', text), re.MULTILINE):
        plain = re.sub(r'\[([^]]+)\]\([^)]*\)', r'\1', title).strip().lower()
        anchor = re.sub(r'[^\w\- ]', '', plain).replace(' ', '-')
        number = taken[anchor] = taken.get(anchor, -1) + 1
        found.append(f'{anchor}-{number}' if number else anchor)
    return found


def links(path, text):
    """Return the targets of a page's links and pictures that lie inside the project."""
    if path.endswith('.rst'):
        found = re.findall(r'`[^`<]*<([^`>]+)>`_', text)
    else:
        prose = re.sub(r'`[^`\n]*`', '', FENCE.sub('', text))
        found = re.findall(r'\]\(\s*([^)\s]+)', prose)
        found += re.findall(r'^\[[^]]+\]:\s*(\S+)', prose, re.MULTILINE)
        found += re.findall(r'(?:src|href)="([^"]+)"', prose)
    return [target for target in found if not OUTSIDE.match(target)]


def broken(path, text):
    """Return the links of a page that lead nowhere."""
    nowhere = []
    for target in links(path, text):
        name, _, anchor = target.partition('#')
        there = (ROOT / path).parent / name if name else ROOT / path
        if not there.is_file():     # Sphinx copies files, and takes a folder for a missing one
            nowhere.append(target)
        elif anchor:
            to = text if there == ROOT / path else there.read_text(encoding='utf-8')
            if there.suffix != '.md' or anchor not in anchors(to):
                nowhere.append(target)
    return nowhere


@pytest.mark.parametrize('path', PAGES)
def test_every_link_of_a_page_leads_somewhere(path):
    assert broken(path, (ROOT / path).read_text(encoding='utf-8')) == []


@pytest.mark.parametrize('path', ['README.md', 'docs/algorithm.md'])
def test_a_page_quotes_the_page_of_benchmarks(path):
    text = text_of(path)
    assert len(QUOTE.findall(text)) == text.count('<!-- quote ') > 0
    assert requoted(text, text_of('docs/benchmarks.md')) == text, \
        'renew them: python -m bench.page README.md docs/algorithm.md'


def test_the_parameter_tables_are_those_of_the_declaration():
    page = text_of('docs/parameters.md')
    assert renewed(page) == page, \
        'renew them: python -m bench.parameter_pages docs/parameters.md'


@pytest.mark.parametrize('page', ['docs/architecture.md', 'docs/algorithm.md'])
def test_every_module_that_a_page_names_exists(page):
    modules = {file.relative_to(root).as_posix() for root, files in (
        (ROOT / 'fuzzy_stereo_ros', (ROOT / 'fuzzy_stereo_ros').rglob('*.py')),
        (ROOT, ROOT.glob('bench/**/*.py'))) for file in files}
    short = {name.split('/')[-1] for name in modules}
    for named in re.findall(r'[\w/]+\.py\b', text_of(page)):
        if not named.startswith('test/'):
            assert named in (modules if '/' in named else short), named


@pytest.mark.parametrize('page', [path for path in PAGES if path.endswith('.md')])
def test_every_test_that_a_page_names_exists(page):
    files = list((ROOT / 'test').rglob('test_*.py'))
    names = {file.stem for file in files} | {
        name for file in files
        for name in re.findall(r'^def (test_\w+)', file.read_text(encoding='utf-8'), re.MULTILINE)}
    assert set(re.findall(r'\btest_\w+', text_of(page))) <= names


@pytest.mark.slow
def test_make_docs_builds_all_pages_without_a_warning(tmp_path):
    for library in ('sphinx', 'myst_parser'):
        pytest.importorskip(library, reason='Sphinx is not installed: requirements/docs.txt')
    (command,) = re.findall(r'^\t\$\(python\) (-m sphinx .*) docs/_build$',
                            text_of('Makefile'), re.MULTILINE)
    done = subprocess.run([sys.executable, *command.split(), str(tmp_path)], cwd=ROOT, text=True,
                          capture_output=True)
    assert (done.returncode, done.stderr) == (0, '')
    assert (tmp_path / 'docs' / 'index.html').exists()


# ---- the sentences that the page of troubles quotes are those of the code ----


NAME = 'docs/troubleshooting.md'
CODE = [ROOT / name for name in ('fuzzy_stereo_ros', 'launch')]


@cache
def texts():
    """Return all texts in the code, with … for what they format, in one string of lines."""
    found = []
    for node in (node for folder in CODE for file in folder.rglob('*.py')
                 for node in ast.walk(ast.parse(file.read_text(encoding='utf-8')))):
        parts = node.values if isinstance(node, ast.JoinedStr) else [node]
        if isinstance(node, (ast.Constant, ast.JoinedStr)):
            found.append(''.join(str(part.value) if isinstance(part, ast.Constant) else '…'
                                 for part in parts))
    return '\n'.join(' '.join(text.split()) for text in found)


@pytest.mark.parametrize('sentence', said(NAME))
def test_a_quoted_sentence_is_one_of_the_code(sentence):
    """Part by part, between … for what differs."""
    assert [part for part in map(str.strip, sentence.split('…')) if part not in texts()] == []
