# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The folder that a replay writes: begun, replaced or continued, and never anybody else's."""
from contextlib import suppress
from dataclasses import asdict, replace
import json
from pathlib import Path
import shutil

from fuzzy_stereo_ros.bags.reading import BagReader, read_stamped
from fuzzy_stereo_ros.bags.writing import METADATA, SUFFIXES, UNFINISHED
from fuzzy_stereo_ros.pairs.image_files import read_json
from fuzzy_stereo_ros.pairs.result_messages import DISPARITY
from fuzzy_stereo_ros.pairs.whole_files import write_whole
from fuzzy_stereo_ros.replay.options import SEGMENT_PAIRS
from fuzzy_stereo_ros.replay.sinks import CALIBRATION

RECORD = 'replay.json'      # what the outputs were made of; it marks a folder as a replay's


class OutputFolder:
    """
    Where outputs go; nothing is written before `begin`.

    path: of the folder; None where no outputs go into one. continued: whether there are outputs
    in it that are to be continued.
    """

    def __init__(self, options, source, copies):
        """
        Check the folder of ReplayOptions.

        source, copies: ReplaySource and CopiedMessages or None, for what the outputs are made of.
        Raises ValueError where the folder may not be used so.
        """
        self.path = None if options.output is None else Path(options.output)
        self._options, self.continued = options, False
        self._record = _record(options, source, copies)
        if self.path is not None:
            self._check()

    def written(self):
        """
        Return the stamps of the last few pairs that are written already, ns, in order.

        They are in the bag, or else in files of the suffix that is written last.
        """
        count = self._options.pairs_before
        if not self.continued:
            return ()
        if not self._options.writes_bag:
            stamps = sorted(
                int(file.stem)
                for file in (self.path / DISPARITY).glob(f'*.{self._options.files[-1]}')
                if file.stem.isdecimal())
            return tuple(stamps[-count:])
        if not (self.path / METADATA).exists():
            return ()
        with BagReader([self.path]) as bag:
            return tuple(read_stamped(message)[0] for message in bag.newest(
                f'/{DISPARITY}', bag.end + 1, count))

    def begin(self):
        """Make the folder, without what a replay before wrote to it unless that is continued."""
        if self.continued or self.path is None:
            return
        self.path.mkdir(exist_ok=True)
        self._clear()
        write_whole(self.path / RECORD, (json.dumps(self._record, indent=2) + '\n').encode())

    def discard(self):
        """Remove what was begun, unless it was continued."""
        if not self.continued and self.path is not None and (self.path / RECORD).is_file():
            self._clear()
            with suppress(OSError):     # it holds other files, is a link or a file system
                self.path.rmdir()

    def _clear(self):
        """Remove what replays write, and nothing else; last the mark that it may be removed."""
        parts = [part for suffix in SUFFIXES.values() for part in self.path.glob(f'*_*{suffix}')]
        names = UNFINISHED, DISPARITY, METADATA, CALIBRATION, RECORD
        for path in (*parts, *(self.path / name for name in names)):
            if path.is_dir() and not path.is_symlink():
                shutil.rmtree(path)
            else:
                path.unlink(missing_ok=True)

    def _check(self):
        path, options = self.path, self._options
        if not path.parent.is_dir():
            raise ValueError(f'--output is {path}, but there is no folder {path.parent}')
        whole = path.resolve()
        for bag in options.bags:
            if whole in (Path(bag).resolve(), *Path(bag).resolve().parents):
                raise ValueError(f'--output is {path}, which holds the input {bag}')
        if not path.exists() or (path.is_dir() and not any(path.iterdir())):
            if options.resume:
                raise ValueError(f'--resume finds nothing to continue in {path}')
            return
        made_by_replay = (path / RECORD).is_file()
        if not made_by_replay and (options.overwrite or options.resume):
            raise ValueError(f'{path} exists and was not made by replay (it has no {RECORD}); '
                             'give another folder')
        if not options.overwrite and not options.resume:
            raise ValueError(f'{path} exists; give another folder'
                             + (', --overwrite or --resume' if made_by_replay else ''))
        if options.resume:
            self._check_record()
            self.continued = True

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
                f"{', '.join(_difference(name, before, now) for name in different)}")


def _record(options, source, copies):
    """Return what the outputs are made of, for JSON; with the same they can be continued."""
    return {
        'bags': [Path(bag).name for bag in options.bags], 'topics': source.topics._asdict(),
        'calibration': source.calibration, 'start': options.start, 'duration': options.duration,
        'every': options.every, 'format': options.storage, 'results': options.words,
        'kept': sorted(copies.topics) if copies else [], 'files': options.files,
        'settings': options.settings, 'segments': SEGMENT_PAIRS if options.in_segments else None,
        'matcher': asdict(replace(options.config, threads=0))}      # they change no result


def _difference(name, before, now):
    """Return how a part of two records differs, in words."""
    old, new = before.get(name), now.get(name)
    if isinstance(old, dict) and isinstance(new, dict):
        return ', '.join(f'{key} ({old.get(key)}, now {new.get(key)})'
                         for key in {**old, **new} if old.get(key) != new.get(key))
    return f'{name} ({old}, now {new})'
