# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Tables of the page of benchmarks, quoted on another page as they are.

`python -m fuzzy_stereo_ros.benchmarks.quoted_tables docs/algorithm.md` renews them between their
marks:
`<!-- quote NAME: TITLE -->` and `<!-- end of quote -->`, NAME being the benchmark's.
"""
from pathlib import Path
import re
import sys

from fuzzy_stereo_ros.pairs.whole_files import write_whole

PAGE = 'benchmarks.md'
QUOTE = re.compile('(<!-- quote (\\w+): (.+?) -->\n)(.*?)(<!-- end of quote -->)', re.DOTALL)


def renewed(text, page):
    """Return a text with its quotes as the tables stand in the text of the page."""
    return QUOTE.sub(lambda found: found[1] + table_of(page, found[2], found[3]) + found[5], text)


def table_of(page, name, title):
    """
    Return the lines of a table in the section of a benchmark; both are found by their names.

    Raises ValueError where the page has no such table.
    """
    section = re.search(f'<!-- begin of {name} -->\n(.*?)<!-- end of {name} -->', page, re.DOTALL)
    table = section and re.search(f'^### {re.escape(title)}\n\n((?:\\|.*\n)+)', section[1],
                                  re.MULTILINE)
    if not table:
        raise ValueError(f"{PAGE} has no table '{title}' of {name}; "
                         f'run `fuzzy-stereo benchmark {name} --output docs/{PAGE}`')
    return table[1]


if __name__ == '__main__':
    for quoting in map(Path, sys.argv[1:]):
        write_whole(quoting, renewed(quoting.read_text(encoding='utf-8'), quoting.with_name(
            PAGE).read_text(encoding='utf-8')).encode())
