# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The page of benchmarks: each report has a section of its own, which the next run replaces."""
from pathlib import Path
import re

from fuzzy_stereo_ros.evaluation.report import markdown
from fuzzy_stereo_ros.pairs.whole_files import check_place, write_whole

HEADING = ('<!-- SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers -->\n'
           '<!-- SPDX-License-Identifier: Apache-2.0 -->\n'
           '# Benchmarks\n\n'
           'Written by `fuzzy-stereo benchmark NAME --output FILE`, which replaces its own '
           'section; not by hand.\n')


def write_section(path, report):
    """
    Write a report into its section of a page, which is made where it does not exist.

    Raises ValueError where the file is no page of benchmarks, OSError where it cannot be written.
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
    """Raise ValueError where `write_section` would not write to a path."""
    path = Path(path)
    if path.suffix != '.md':
        raise ValueError(f"{path} has the suffix '{path.suffix}'; a page of benchmarks has .md")
    check_place(path)
    if path.exists() and not path.read_text(encoding='utf-8').startswith(HEADING):
        raise ValueError(f'{path} exists and is no page of benchmarks; name another file')
