# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Tables and reports: cells of text, Markdown, and the machine of the measurement."""
from dataclasses import dataclass, field
from importlib import metadata
import math
import os
from pathlib import Path
import platform
import re

import cv2
import fuzzy_stereo_ros
import numpy as np
import pandas as pd


@dataclass(frozen=True)
class Table:
    """A table: the first column has names, the others numbers or words, or None, a dash."""

    title: str
    columns: tuple
    rows: list
    note: str = ''
    digits: int = 2  # after the decimal point of each float

    @classmethod
    def of(cls, title, frame, note='', digits=2):
        """Return the table of a DataFrame; its index becomes the first column."""
        frame = frame.astype(object).where(frame.notna(), None)
        return cls(title, ('', *frame.columns), list(frame.itertuples(name=None)), note, digits)

    @property
    def cells(self):
        """A DataFrame of the cells as printed texts."""
        return pd.DataFrame([[cell(value, self.digits) for value in row] for row in self.rows],
                            columns=list(self.columns))

    @property
    def markdown(self):
        """The cells as a Markdown table, without title and note."""
        return self.cells.to_markdown(
            index=False, disable_numparse=True,
            colalign=('left', *('right',) * (len(self.columns) - 1)) if self.rows else None)


@dataclass(frozen=True)
class Report:
    """The report of a benchmark or an evaluation."""

    name: str
    title: str
    settings: dict  # {what: how} of everything that the figures depend on
    tables: list
    skipped: list = field(default_factory=list)  # sentences
    pictures: dict = field(default_factory=dict)  # {file beside a page: its bytes}


def environment(threads):
    """Return machine, versions, threads and load of a measurement, {what: words}."""
    return {
        'machine': f'{_processor()}, {os.cpu_count()} cores, {platform.machine()}, '
                   f'{platform.system()}',
        'versions': ', '.join([
            f'Python {platform.python_version()}', f'OpenCV {cv2.__version__}',
            f'fuzzy_stereo_ros {fuzzy_stereo_ros.__version__}', f'NumPy {np.__version__}',
            f"numba {metadata.version('numba')}"]),
        'threads': threads,
        'load': f'load average (1 min) {os.getloadavg()[0]:.1f}',
    }


def markdown(report):
    """Return a report as a section of a Markdown page."""
    parts = [f'## {report.title}', '\n'.join(
        f'- {what}: {how}' for what, how in report.settings.items())]
    if report.skipped:
        parts.append('\n'.join(['Skipped:\n', *(f'- {sentence}' for sentence in report.skipped)]))
    for table in report.tables:
        parts += [f'### {table.title}', table.markdown]
        if table.note:
            parts.append(table.note)
    return '\n\n'.join(parts) + '\n'


def cell(value, digits):
    """Return the printed text of a cell."""
    if value is None or isinstance(value, float) and math.isnan(value):
        return '-'
    return f'{value:.{digits}f}' if isinstance(value, float) else str(value)


def _processor():
    try:
        found = re.search(r'^model name\s*:\s*(.+)$',
                          Path('/proc/cpuinfo').read_text(encoding='utf-8'), re.MULTILINE)
    except OSError:
        found = None
    return found[1].strip() if found else platform.processor() or 'unknown processor'
