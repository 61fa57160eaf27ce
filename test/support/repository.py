# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Where the repository is, for tests in folders of different depth, and Python started there."""
import os
from pathlib import Path
import subprocess
import sys

ROOT = Path(__file__).resolve().parents[2]
COMMAND_LINE = 'fuzzy_stereo_ros.commands.command_line'


def run_python(*words, before=(), folder=ROOT, **variables):
    """Run Python with words, others before, and variables of the environment; return its end."""
    return subprocess.run(
        [*before, sys.executable, *map(str, words)], cwd=folder, capture_output=True, text=True,
        env={**os.environ, **variables})


def printed_by(*words, **options):
    """Return what `run_python` prints, which must end with code 0."""
    done = run_python(*words, **options)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout
