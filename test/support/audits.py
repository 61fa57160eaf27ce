# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a process that runs under `audited.py` opened, apart from what every process opens."""
import json
import os
from pathlib import Path

import fuzzy_stereo_ros
from fuzzy_stereo_ros.matching import StereoMatcher, WARM_UP_SIZE
from fuzzy_stereo_ros.matching.kernels.compiled import FOLDER
from repository import ROOT

CODE = Path(fuzzy_stereo_ros.__file__).parent
ASKING = 'subprocess.Popen', 'lscpu'    # by numpy.testing of NumPy 1, which numba imports


def environment(folder, module):
    """Return what is set for an audited module whose home is in a folder; kernels are there."""
    StereoMatcher().warm_up(*WARM_UP_SIZE)      # processes are started to compile them
    return {'AUDITED_MODULE': module, 'AUDITED_NOTES': str(folder / 'notes'),
            'PYTHONPATH': os.pathsep.join([str(ROOT), str(ROOT / 'test' / 'support')]),
            'HOME': str(folder / 'home'), 'PYTHONDONTWRITEBYTECODE': '1'}


def is_cache(path):
    """Return whether a path is of the cache of kernels, or of Python's own beside the code."""
    return FOLDER.parent in (path, *path.parents) or (
        CODE in path.parents and '__pycache__' in path.parts)


def noted(folder, allowed):
    """Return what was noted but for writing below allowed folders and to caches of code."""
    lines = (folder / 'notes').read_text().splitlines()
    notes = [json.loads(line) for line in lines]
    assert notes, 'nothing was noted'
    return [(event, where) for event, where in notes if event.startswith('socket') or not any(
        one in (Path(where), *Path(where).parents) for one in (*allowed, Path(os.devnull)))
        and not is_cache(Path(where)) and (event, Path(where).name) != ASKING]


def all_files(folder):
    return {path for path in folder.rglob('*') if path.is_file()}
