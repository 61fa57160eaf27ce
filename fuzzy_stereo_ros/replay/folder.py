# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The folder that a replay writes: begun, replaced or continued, and never anybody else's."""
from contextlib import suppress
import json
from pathlib import Path
import shutil

from fuzzy_stereo_ros.bags.parts import METADATA, part_paths
from fuzzy_stereo_ros.bags.writing import FORMATS, UNFINISHED
from fuzzy_stereo_ros.pairs.whole_files import write_whole
from fuzzy_stereo_ros.replay.sinks import CALIBRATION
from fuzzy_stereo_ros.result_topics import DISPARITY
from fuzzy_stereo_ros.saved_pairs.checked_files import read_json

RECORD = 'replay.json'      # what the outputs were made of; it marks a folder as a replay's


class ReplayFolder:
    """
    Where outputs go; nothing is written before `begin`.

    path: of the folder; None where no outputs go into one. continued: whether there are outputs
    in it that are to be continued.
    """

    def __init__(self, path, record, inputs=(), overwrite=False, resume=False):
        """
        Check a folder.

        path: None for no folder. record: what the outputs are made of, for JSON; the same
        continues them. inputs: paths of bags. overwrite, resume: what may be done with outputs
        that are there.
        Raises ValueError where it may not be used so.
        """
        self.path = None if path is None else Path(path)
        self._record, self.continued = record, False
        if overwrite and resume:
            raise ValueError('--overwrite begins anew and --resume goes on: give one of them')
        if path is None:
            return
        if not self.path.parent.is_dir():
            raise ValueError(f'--output is {path}, but there is no folder {self.path.parent}')
        whole = self.path.resolve()
        for one in inputs:
            if whole == Path(one).resolve() or whole in Path(one).resolve().parents:
                raise ValueError(f'--output is {path}, which holds the input {one}')
        if not self.path.exists() or (self.path.is_dir() and not any(self.path.iterdir())):
            if resume:
                raise ValueError(f'--resume: there is nothing to continue in {path}')
            return
        made_by_replay = (self.path / RECORD).is_file()
        if not made_by_replay and (overwrite or resume):
            raise ValueError(f'{path} is there and was not made by replay (it has no {RECORD}); '
                             'give another folder')
        if not overwrite and not resume:
            raise ValueError(f'{path} is there already; give another folder'
                             + (', --overwrite or --resume' if made_by_replay else ''))
        if resume:
            self._check_record()
            self.continued = True

    def begin(self):
        """Make the folder, without what a replay before wrote to it unless that is continued."""
        if self.continued or self.path is None:
            return
        self.path.mkdir(exist_ok=True)
        self._clear()
        write_whole(self.path / RECORD, (json.dumps(self._record, indent=2) + '\n').encode())

    def discard(self):
        """Remove what was written where nothing came of anything, unless it is continued."""
        if not self.continued and self.path is not None and (self.path / RECORD).is_file():
            self._clear()
            with suppress(OSError):     # it holds other files, is a link or a file system
                self.path.rmdir()

    def _clear(self):
        """Remove what replays write, and nothing else; last the mark that it may be removed."""
        parts = [part for storage in FORMATS for part in part_paths(self.path, storage)]
        names = UNFINISHED, DISPARITY, METADATA, CALIBRATION, RECORD
        for path in (*parts, *(self.path / name for name in names)):
            if path.is_dir() and not path.is_symlink():
                shutil.rmtree(path)
            else:
                path.unlink(missing_ok=True)

    def _check_record(self):
        path, before = self.path / RECORD, None
        with suppress(ValueError):
            before = read_json(path)
        if not isinstance(before, dict):
            raise ValueError(f'{path} is damaged; begin anew with --overwrite')
        now = json.loads(json.dumps(self._record))
        different = [name for name in {**before, **now} if before.get(name) != now.get(name)]
        if different:
            raise ValueError(
                f'--resume goes on with the options of before; different are '
                f"{', '.join(_told(name, before, now) for name in different)}")


def _told(name, before, now):
    """Return in words what a part of two records differs in."""
    old, new = before.get(name), now.get(name)
    if isinstance(old, dict) and isinstance(new, dict):
        return ', '.join(f'{key} ({old.get(key)}, now {new.get(key)})'
                         for key in {**old, **new} if old.get(key) != new.get(key))
    return f'{name} ({old}, now {new})'
