# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Where compiled kernels lie between two processes: a folder that is named by all their sources.

numba looks at the file of a kernel alone, not at those of the kernels that are compiled into it.
"""
import hashlib
import os
from pathlib import Path
import shutil
import sys
import tempfile
from typing import NamedTuple

from fuzzy_stereo_ros.matching.kernels.keeping import locked
import numba

NAME = 'fuzzy_stereo_ros'
KEPT = 8        # folders of an installation: of other sources, other versions of Python and numba
PROBE = bytes(1 << 16)      # a full disk still takes files without content
SOURCES = Path(__file__).parent


class Choice(NamedTuple):
    """
    The folder that compiled kernels are kept in.

    folder: a Path, None where none can be written to. remark: a sentence on what is done without
    for that reason, '' where nothing is.
    """

    folder: Path | None
    remark: str


def choose_folder():
    """
    Return the Choice for this process; the folder is made, and those long not used are removed.

    It is in what NUMBA_CACHE_DIR names, else beside the kernels, else in the user's cache. A new
    one starts with what was compiled in another of these that can only be read.
    """
    wanted = [Path(numba.config.CACHE_DIR) / NAME] if numba.config.CACHE_DIR else []
    places = [*wanted, SOURCES / '__pycache__', *_user_cache()]
    name = f'{_installation()}{_content()}'
    folders = [place.absolute() / name for place in places]
    refused = []
    for place, folder in zip(places, folders):
        try:
            _copy_read_only(folders, folder)
            make_folder(folder)
            os.utime(folder)    # it is in use
        except OSError as error:
            refused.append(f'{place}: {error.strerror}')
            continue
        _remove_older(folder)
        return Choice(folder, f'compiled kernels cannot be kept in NUMBA_CACHE_DIR '
                              f'({refused[0]}): they are kept in {place}'
                      if wanted and refused else '')
    return Choice(None, 'no folder for compiled kernels can be written to '
                        f"({', '.join(refused)}): they are compiled at each start, which takes "
                        'up to 60 s; set NUMBA_CACHE_DIR to a folder that can be')


def make_folder(folder):
    """Make a folder where there is none; OSError where nothing can be written to it."""
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryFile(dir=folder, buffering=0) as probe:
        if probe.write(PROBE) < len(PROBE):
            probe.write(PROBE)      # tells why


def _copy_read_only(folders, folder):
    """Fill a folder that is not there from the first that is and is not writable; or leave it."""
    filled = (other for other in folders if other.is_dir() and not os.access(other, os.W_OK))
    source = next(filled, None)
    if source is None or folder.exists():
        return
    new = folder.with_name(f'{folder.name}.{os.getpid()}')
    try:
        for part in source.iterdir():
            (new / part.name).mkdir(parents=True)
            with locked(part, 'LOCK_SH'):
                for file in part.glob('*.nb?'):
                    shutil.copyfile(file, new / part.name / file.name)
        new.rename(folder)
    except OSError:
        shutil.rmtree(new, ignore_errors=True)


def _user_cache():
    """Return the user's cache for this package in a list, which is empty where there is none."""
    named = os.environ.get('XDG_CACHE_HOME', '')
    place = Path(named if os.path.isabs(named) else os.path.expanduser('~/.cache'))
    # Without HOME and without a name in the system's list of users `~` remains.
    return [place / NAME] if place.is_absolute() else []


def _installation():
    """Return how the names of all folders of this installation begin."""
    return f'kernels_{hashlib.sha256(os.fsencode(SOURCES.absolute())).hexdigest()[:12]}_'


def _content():
    """Return a digest of all that compiled kernels depend on but for the processor."""
    digest = hashlib.sha256(repr((
        sys.version_info[:2], numba.__version__, numba.config.BOUNDSCHECK)).encode())
    for source in sorted(SOURCES.rglob('*.py')):
        content = source.read_bytes()
        name = source.relative_to(SOURCES).as_posix()
        digest.update(f'{name} {len(content)} '.encode() + content)
    return digest.hexdigest()[:16]


def _remove_older(folder):
    """Leave those folders of this installation that were in use last."""
    ages = {}
    for other in folder.parent.glob(f'{_installation()}*'):
        try:
            ages[other] = -other.stat().st_mtime_ns
        except OSError:
            continue        # another process has removed it
    for other in sorted(ages, key=ages.get)[KEPT:]:
        shutil.rmtree(other, ignore_errors=True)
