# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Every link inside the project leads to a file that is there, and to a heading in it."""
import re

from pages import FENCE, ROOT
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
        if not there.exists():
            nowhere.append(target)
        elif anchor:
            to = text if there == ROOT / path else there.read_text(encoding='utf-8')
            if there.suffix != '.md' or anchor not in anchors(to):
                nowhere.append(target)
    return nowhere


@pytest.mark.parametrize('path', PAGES)
def test_every_link_of_a_page_leads_somewhere(path):
    assert broken(path, (ROOT / path).read_text(encoding='utf-8')) == []


def test_the_pages_are_read_over_the_whole_project():
    assert {'README.md', 'CHANGELOG.rst', 'docs/troubleshooting.md'} <= set(PAGES)
    assert any(links(path, (ROOT / path).read_text(encoding='utf-8')) for path in PAGES)


@pytest.mark.parametrize('link', [
    '[a](docs/missing.md)', '![a](docs/missing.png)', '[a](#missing)', '[a](LICENSE#missing)',
    '[a](docs/algorithm.md#missing)', '[a]: docs/missing.md', '<img src="docs/missing.png">'])
def test_a_link_that_leads_nowhere_is_found_out(link):
    assert len(broken('README.md', f'# Title\n\n{link}\n')) == 1


def test_links_to_headings_in_code_and_outside_are_told_apart():
    text = '# One: two `three`\n# Again\n# Again\n[a](#one-two-three) [b](#again-1) `[c](none)`\n'
    assert broken('README.md', text + '[d](https://example.org/none)\n') == []
    assert links('CHANGELOG.rst', '`a <docs>`_ and `b <https://example.org>`_') == ['docs']
