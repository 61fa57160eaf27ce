# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What recordings for the Rerun viewer hold, where rerun-sdk is installed."""
import re
import subprocess
import sys

import pytest


def needed_rerun(monkeypatch):
    """Return the module, kept from telling its makers that it is used; or skip the test."""
    monkeypatch.setenv('RERUN_ANALYTICS_ENABLED', '0')
    return pytest.importorskip(
        'rerun', reason='rerun-sdk is not installed: an optional extra of 170 MB')


def rows_of(path):
    """Return {entity: number of rows} of a recording as rerun itself reads it."""
    for command in ('verify', 'print'):
        told = subprocess.run([sys.executable, '-m', 'rerun', 'rrd', command, path],
                              capture_output=True, text=True, check=True)
    rows = {}
    for number, entity in re.findall(r'with (\d+) rows .*? - /(\S+) - ', told.stdout):
        rows[entity] = rows.get(entity, 0) + int(number)
    return rows
