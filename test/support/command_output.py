# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a command prints, and what it says of input that it cannot take."""
import json
from pathlib import Path

from fuzzy_stereo_ros.commands.command_line import main


def printed(capsys, *words, code=0):
    """Return what a command prints that ends with a code; with --json, what is in it."""
    capsys.readouterr()
    assert main([*map(str, words)]) == code, capsys.readouterr().err
    out = capsys.readouterr().out
    return json.loads(out) if '--json' in words else out


def rejection(capsys, *words, run=main):
    """
    Return the one line with which a command ends in vain, with code 2; nothing else is printed.

    The working folder holds what it held before.
    """
    before = contents()
    capsys.readouterr()
    try:
        code = run([*map(str, words)])
    except SystemExit as ended:
        code = ended.code
    out, err = capsys.readouterr()
    assert (code, out, err.count('\n')) == (2, '', 1), err
    assert contents() == before
    return err


def contents():
    """Return {path: its bytes, None of a folder} of all below the working folder, a test's own."""
    assert not Path('setup.py').exists(), 'other tests write to the repository as well'
    return {path: path.read_bytes() if path.is_file() else None for path in Path().rglob('*')}
