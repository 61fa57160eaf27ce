# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Files that are there as a whole or not at all."""
import os
from pathlib import Path


def check_place(path):
    """Raise ValueError where no file can be written to a path: no folder, or it is one itself."""
    path = Path(path)
    if not path.parent.is_dir():
        raise ValueError(f'{path} cannot be written: there is no folder {path.parent}')
    if path.is_dir():
        raise ValueError(f'{path} is a folder; name a file')


def write_whole(path, content):
    """
    Write bytes to a file: on an error what was there before stays, and nothing is left behind.

    path: str or Path; an existing file is replaced. Raises OSError, which names the file, where
    it cannot be written.
    """
    path = Path(path)
    part = path.with_name(f'.{path.name}.{os.getpid()}.part')
    part.unlink(missing_ok=True)
    try:
        with open(part, 'xb') as file:      # never through a link that somebody else has put there
            file.write(content)
        part.replace(path)
    except OSError as error:
        if error.errno is not None:     # the system names the unfinished file, or none
            error.filename, error.filename2 = str(path), None
        raise
    finally:
        part.unlink(missing_ok=True)
