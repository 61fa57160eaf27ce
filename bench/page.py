# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The page of benchmarks: each report has a section, which the next run replaces.

Pictures, which the suites draw from the tables of their reports, are SVG files beside the page.

`python -m bench.page README.md docs/algorithm.md` renews the tables that
pages quote, between `<!-- quote NAME: TITLE -->` and `<!-- end of quote -->`. NAME is that of the
benchmark; `TITLE | WORDS | WORDS` quotes only the rows with one of these words.
"""
from importlib.util import find_spec
import io
from pathlib import Path
import re
import sys

from fuzzy_stereo_ros.evaluation.report import markdown
from fuzzy_stereo_ros.pairs.image_files import check_place, write_whole

PAGE = 'benchmarks.md'
HEADING = ('<!-- SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers -->\n'
           '<!-- SPDX-License-Identifier: Apache-2.0 -->\n'
           '# Benchmarks\n\n'
           'Written by `python -m bench NAME --output FILE`, which replaces its own '
           'section; not by hand.\n')
# Blue is ours, orange OpenCV tuned.
BLUE, MIDDLE_BLUE, LIGHT_BLUE, ORANGE = '#0b5fa5', '#3f8bc4', '#74b3e0', '#c8560b'
STYLE = {'svg.fonttype': 'none', 'font.size': 9, 'axes.titlesize': 10, 'axes.axisbelow': True,
         'axes.spines.top': False, 'axes.spines.right': False}
QUOTE = re.compile('(<!-- quote (\\w+): (.+?) -->\n)(.*?)(<!-- end of quote -->)', re.DOTALL)


def write_section(path, report):
    """
    Write a report into its section of a page, which is created if it does not exist.

    Raises ValueError if the file is no page of benchmarks, OSError if it cannot be written.
    """
    check_page(path)
    page = Path(path).read_text(encoding='utf-8') if Path(path).exists() else HEADING
    begin, end = (f'<!-- {edge} of {report.name} -->' for edge in ('begin', 'end'))
    shown = ''.join(f'\n![{report.title}]({name})\n' for name in report.pictures)
    section = f'{begin}\n{markdown(report)}{shown}{end}\n'
    pattern = re.compile(f'{re.escape(begin)}\n.*?{re.escape(end)}\n', re.DOTALL)
    if pattern.search(page):
        page = pattern.sub(lambda _: section, page)
    else:
        page = f'{page.rstrip()}\n\n{section}'
    for name, content in report.pictures.items():
        write_whole(Path(path).with_name(name), content)
    write_whole(path, page.encode())


def check_page(path):
    """Raise ValueError if `write_section` cannot write to a path."""
    path = Path(path)
    if path.suffix != '.md':
        raise ValueError(f"{path} has the suffix '{path.suffix}'; a page of benchmarks has .md")
    check_place(path)
    if path.exists() and not path.read_text(encoding='utf-8').startswith(HEADING):
        raise ValueError(f'{path} exists and is no page of benchmarks; name another file')


def requoted(text, page):
    """Return a text whose quoted tables are those of a page; text, page: the contents."""
    return QUOTE.sub(lambda found: found[1] + table_of(page, found[2], found[3]) + found[5], text)


def table_of(page, name, title):
    """
    Return the lines of a table in the section of a benchmark of a page.

    title: of the table, or 'title | words | words' for the rows that have one of the words.
    Raises ValueError if the page has no such table.
    """
    title, *words = title.split(' | ')
    section = re.search(f'<!-- begin of {name} -->\n(.*?)<!-- end of {name} -->', page, re.DOTALL)
    table = section and re.search(f'^### {re.escape(title)}\n\n((?:\\|.*\n)+)', section[1],
                                  re.MULTILINE)
    if not table:
        raise ValueError(f"{PAGE} has no table '{title}' of {name}; "
                         f'run `python -m bench {name} --output docs/{PAGE}`')
    head, rows = table[1].splitlines(True)[:2], table[1].splitlines(True)[2:]
    return ''.join(head + [row for row in rows if not words or any(one in row for one in words)])


def as_svg(name, draw):
    """
    Return {name: content of an SVG file}, and sentences about what is missing.

    name: of the file. draw: returns a Figure; called only if matplotlib is installed.
    """
    if find_spec('matplotlib') is None:
        return {}, [f'{name}: matplotlib is not installed']
    from matplotlib import rc_context

    stream = io.BytesIO()
    with rc_context({**STYLE, 'svg.hashsalt': name}):
        draw().savefig(stream, format='svg', metadata={'Date': None})
    return {name: stream.getvalue()}, []


def titled(tables, start):
    """Return the first of the tables whose title starts with a text."""
    return next(table for table in tables if table.title.startswith(start))


def column(table, name):
    """Return {name of a row: its cell in a column}."""
    place = table.columns.index(name)
    return {row[0]: row[place] for row in table.rows}


def figure_of(width, height, title=''):
    """Return an empty Figure; width, height: inches."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout='constrained')
    if title:
        figure.suptitle(title, fontsize=11)
    return figure


def add_legend(figure, columns=3):
    """Add a legend of the first panel below a Figure."""
    figure.legend(*figure.axes[0].get_legend_handles_labels(), loc='outside lower center',
                  ncols=columns, frameon=False)


if __name__ == '__main__':
    for quoting in map(Path, sys.argv[1:]):
        page = (quoting.resolve().parent / 'docs' / PAGE if quoting.name == 'README.md'
                else quoting.with_name(PAGE))
        write_whole(quoting, requoted(quoting.read_text(encoding='utf-8'),
                                      page.read_text(encoding='utf-8')).encode())
