# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Figures as a report: Markdown for people, JSON for programs, and where they were taken."""
from dataclasses import asdict, dataclass, field, replace
from importlib import metadata
import math
import os
from pathlib import Path
import platform
import re

import cv2


@dataclass(frozen=True)
class Table:
    """
    One table: the first column names, the others hold numbers or words; None prints as a dash.

    digits: after the decimal point of every number that is not whole by type.
    """

    title: str
    columns: tuple
    rows: list
    note: str = ''
    digits: int = 2


@dataclass(frozen=True)
class Report:
    """
    What one benchmark found.

    settings: {what: how}, everything that the figures depend on. skipped: sentences.
    pictures: {name of a file: its bytes}; they are written beside a page.
    """

    name: str
    title: str
    settings: dict
    tables: list
    skipped: list = field(default_factory=list)
    pictures: dict = field(default_factory=dict)


def environment(threads):
    """Return the machine and the versions that figures were taken with, as {what: word}."""
    versions = {'fuzzy_stereo_ros': 'fuzzy_stereo_ros', 'NumPy': 'numpy', 'numba': 'numba'}
    return {
        'machine': f'{_processor()}, {os.cpu_count()} cores, {platform.machine()}, '
                   f'{platform.system()}',
        'versions': ', '.join([
            f'Python {platform.python_version()}', f'OpenCV {cv2.__version__}',
            *(f'{name} {_version(package)}' for name, package in versions.items())]),
        'threads': threads,
        'load': f'{os.getloadavg()[0]:.1f} processes wanted to run in the last minute',
    }


def markdown(report):
    """Return a report as a section of a Markdown page."""
    parts = [f'## {report.title}', _list(f'{what}: {how}' for what, how in
                                         report.settings.items())]
    if report.skipped:
        parts.append('Skipped:\n\n' + _list(report.skipped))
    for table in report.tables:
        parts += [f'### {table.title}', _grid(table)]
        if table.note:
            parts.append(table.note)
    return '\n\n'.join(parts) + '\n'


def for_json(report):
    """Return a report as JSON can hold it: without pictures; a figure over nothing is null."""
    return _without_nan(asdict(replace(report, pictures={})))


def _list(sentences):
    return '\n'.join(f'- {sentence}' for sentence in sentences)


def _grid(table):
    """Return a table with columns of equal width, names to the left, figures to the right."""
    lines = [tuple(table.columns)]
    lines += [tuple(cell(value, table.digits) for value in row) for row in table.rows]
    widths = [max(len(line[place]) for line in lines) for place in range(len(table.columns))]
    written = ['| ' + ' | '.join(
        word.rjust(width) if place else word.ljust(width)
        for place, (word, width) in enumerate(zip(line, widths))) + ' |' for line in lines]
    rule = f"|{'-' * (widths[0] + 2)}|" + ''.join(f"{'-' * (width + 1)}:|"
                                                  for width in widths[1:])
    return '\n'.join([written[0], rule, *written[1:]])


def cell(value, digits):
    """Return one cell as it is printed."""
    if value is None or isinstance(value, float) and math.isnan(value):
        return '-'
    return f'{value:.{digits}f}' if isinstance(value, float) else str(value)


def _without_nan(value):
    if isinstance(value, dict):
        return {key: _without_nan(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [_without_nan(entry) for entry in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _processor():
    """Return the processor's name where the system tells it."""
    try:
        found = re.search(r'^model name\s*:\s*(.+)$',
                          Path('/proc/cpuinfo').read_text(encoding='utf-8'), re.MULTILINE)
    except OSError:
        found = None
    return found[1].strip() if found else platform.processor() or 'unknown processor'


def _version(package):
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return 'not installed'
