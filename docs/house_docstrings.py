# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Docstrings as they are written in this project, into reStructuredText."""
import re

ITEM = re.compile(r'([a-z_]\w*(?:, [a-z_]\w*)*)(?:\(\w*\))?: ')
RULE = re.compile(r'\|[-|]+\|')


def in_markup(lines):
    """
    Return the lines of a docstring with lists and tables marked up.

    A line `name, other: what they are` begins an item, up to a blank line, the next item, or a
    line that begins a sentence of its own; a table is that of Markdown.
    """
    marked, inside = [], False
    for line in map(str.rstrip, lines):
        if line.startswith('|'):
            marked += _row(line, header=not (marked and marked[-1].startswith('     - ')))
            continue
        line = line.replace('|', r'\|')
        item = ITEM.match(line)
        sentence = line[:1].isupper() and bool(marked) and marked[-1].endswith('.')
        if item:
            marked += ['', f'- **{item[1]}**: {line[item.end():]}']
        elif inside and line and not sentence:
            marked.append(f'  {line.strip()}')
        else:
            marked += ['', line] if inside else [line]
        inside = bool(item) or inside and bool(line) and not sentence
    return [*marked, '']


def _row(line, header):
    """Return a line of a table as one of a list-table."""
    if RULE.fullmatch(line):
        return []
    first, *others = (cell.strip() for cell in line.strip('|').split('|'))
    begin = ['.. list-table::', '   :header-rows: 1', ''] if header else []
    return [*begin, f'   * - {first}', *(f'     - {cell}' for cell in others)]
