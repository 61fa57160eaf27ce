# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Where compiled kernels lie between two processes: in a folder that is named by all their sources.

numba looks at the file of a kernel alone, not at those of the kernels that are compiled into it.
"""
import hashlib
import os
from pathlib import Path
import platform
import shutil
import sys
import tempfile
from typing import NamedTuple

import numba

NAME = 'fuzzy_stereo_ros'
KEPT = 8        # folders in a place: of other sources, other versions of Python and numba
PROBE = bytes(1 << 16)      # a full disk still takes files without content
SOURCES = Path(__file__).parent
BROUGHT = SOURCES / 'brought'       # what a wheel has, see `make wheel`


class Folders(NamedTuple):
    """
    The folders of compiled kernels.

    kept: a Path to write to, None where none can be. readable: more Paths that have some.
    warning: a sentence on what is done without for want of a folder, '' where nothing is.
    on_compiling: one for when a kernel is found nowhere.
    """

    kept: Path | None
    readable: tuple
    warning: str
    on_compiling: str


def choose_folders():
    """
    Return the Folders of this process; the first is made, and those long not used are removed.

    It is in what NUMBA_CACHE_DIR names, else beside the kernels, else in the user's cache. What
    was compiled in another of these that can only be read, or came with the package, is read.
    """
    wanted = [Path(numba.config.CACHE_DIR) / NAME] if numba.config.CACHE_DIR else []
    places = [*wanted, SOURCES / '__pycache__', *_user_cache()]
    name = folder_name()
    folders = [place.absolute() / name for place in places]
    readable = (*(folder for folder in folders
                  if folder.is_dir() and not os.access(folder, os.W_OK)),
                *filter(Path.is_dir, [BROUGHT / name]))
    denied = []
    for place, folder in zip(places, folders):
        try:
            make_folder(folder)
            os.utime(folder)    # it is in use
        except OSError as error:
            denied.append(f'{place}: {error.strerror}')
            continue
        _remove_older(folder)
        return Folders(folder, readable, '' if not (wanted and denied) else
                       f'compiled kernels cannot be kept in NUMBA_CACHE_DIR ({denied[0]}): they '
                       f'are kept in {place}', _unlike_brought())
    warning = ('no folder for compiled kernels can be written to '
               f"({', '.join(denied)}): they are compiled at each start, which takes up to 60 s; "
               'set NUMBA_CACHE_DIR to a folder that can be')
    return Folders(None, readable, *(('', warning) if readable else (warning, '')))


def make_folder(folder):
    """Make a folder where there is none; OSError where nothing can be written to it."""
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryFile(dir=folder, buffering=0) as probe:
        if probe.write(PROBE) < len(PROBE):
            probe.write(PROBE)      # tells why


def folder_name():
    """Return a name made of all that compiled kernels depend on but for the processor."""
    digest = hashlib.sha256(repr(numba.config.BOUNDSCHECK).encode())
    for source in sorted(SOURCES.rglob('*.py')):
        content = source.read_bytes()
        name = source.relative_to(SOURCES).as_posix()
        digest.update(f'{name} {len(content)} '.encode() + content)
    return (f'kernels_{sys.implementation.cache_tag}_numba-{numba.__version__}_'
            f'{digest.hexdigest()[:16]}')


def _unlike_brought():
    """Return what to say where a kernel is compiled although some came with the package, or ''."""
    brought = ', '.join(sorted(path.name.split('_', 1)[1] for path in BROUGHT.glob('kernels_*')))
    return brought and (
        f'the package came with kernels for {brought}, default profiles and processors from '
        f"x86-64-v3 on; here is {folder_name().split('_', 1)[1]} on {platform.machine()}: what "
        'is not among them is compiled once')


def _user_cache():
    """Return the user's cache for this package in a list, which is empty where there is none."""
    named = os.environ.get('XDG_CACHE_HOME', '')
    place = Path(named if os.path.isabs(named) else os.path.expanduser('~/.cache'))
    # Without HOME and without a name in the system's list of users `~` remains.
    return [place / NAME] if place.is_absolute() else []


def _remove_older(folder):
    """Leave those folders beside a folder, itself among them, that were in use last."""
    ages = {}
    for other in folder.parent.glob('kernels_*'):
        try:
            ages[other] = -other.stat().st_mtime_ns
        except OSError:
            continue        # another process has removed it
    for other in sorted(ages, key=ages.get)[KEPT:]:
        shutil.rmtree(other, ignore_errors=True)
