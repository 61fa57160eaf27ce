# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The texts in the code and the launch files, … for what is filled in; for pages that quote."""
import ast
from functools import cache
import re

from repository import ROOT

FOLDERS = [ROOT / name for name in ('fuzzy_stereo_ros', 'launch')]


def _text(node):
    """Return the text of a constant or an f-string, None for anything else."""
    if isinstance(node, ast.Constant):
        return node.value if isinstance(node.value, str) else None
    if isinstance(node, ast.JoinedStr):
        return ''.join(part.value if isinstance(part, ast.Constant) else '…'
                       for part in node.values)
    return None


@cache
def texts():
    """Return all texts in the code, in one string, parted by lines."""
    found = []
    for file in (file for folder in FOLDERS for file in folder.rglob('*.py')):
        for node in ast.walk(ast.parse(file.read_text(encoding='utf-8'))):
            text = _text(node)
            if text:
                found.append(' '.join(text.split()))
    return '\n'.join(found)


def missing_parts(sentence):
    """Return the parts of a sentence, parted by …, that stand nowhere in the code."""
    parts = [part.strip() for part in re.split('…', sentence)]
    return [part for part in parts if part and part not in texts()]
