# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The sinks of a replay: a bag, files, a video; and the folder they write to.

A sink has add(matched, item), called with each MatchedPair and its Item in the order of the bag,
and close(), called in any case. All calls come from the thread that made the sink. An OSError, as
of a full disk, or a ValueError of a sink ends the replay.
"""
from collections import Counter, deque
from contextlib import ExitStack, suppress
from dataclasses import asdict, replace
import json
from pathlib import Path

from fuzzy_stereo_ros.bags.reading import BagReader, read_stamped
from fuzzy_stereo_ros.bags.writing import (
    BagWriter, Messages, METADATA, STORAGE_SUFFIXES, UNFINISHED)
from fuzzy_stereo_ros.pairs.disparity_files import write_disparity
from fuzzy_stereo_ros.pairs.image_files import read_json, remove, write_whole
from fuzzy_stereo_ros.pairs.result_messages import DISPARITY, ResultMessages, topics_of
from fuzzy_stereo_ros.replay.options import SEGMENT_PAIRS, WARM_PAIRS
from fuzzy_stereo_ros.replay.source import rejection_of
from fuzzy_stereo_ros.views.video import RATES, VideoSink

CALIBRATION = 'calibration.json'
RECORD = 'replay.json'      # the options of the outputs; it marks a folder as one of a replay
PROGRESS = 'progress.json'  # positions of the last few pairs, where no bag has them
STAMP_DIGITS = 19           # of ns since 1970, so that names sort by time


class Outputs:
    """
    The sinks of a replay and their folder; the thread that writes makes them with the first pair.

    config: the MatcherConfig at the scale at which images are matched. path: of the folder, None
    without one. continued: whether earlier outputs in it are continued. sinks: a list, None before
    the first pair. bag_sink: the BagSink among them, or None. written: number of pairs that all
    sinks took. log_time: ns, of the last of these.
    """

    def __init__(self, options, source, copies):
        """Check the folder and the video, and open no other output yet; ValueError."""
        self.config, self.sinks, self.bag_sink = options.scaled_config, None, None
        self.path = None if options.output is None else Path(options.output)
        self.continued, self.written, self.log_time = False, 0, None
        self._options, self._source, self._copies = options, source, copies
        # Everything the results depend on: --resume needs the same.
        self._record = json.loads(json.dumps({
            'bags': [Path(bag).name for bag in options.bags], **source.topics._asdict(),
            'calibration': source.calibration, 'start': options.start,
            'duration': options.duration, 'every': options.every, 'format': options.storage,
            'results': options.bag_results, 'kept': sorted(copies.topics) if copies else [],
            'files': options.files, **options.settings,
            'segments': SEGMENT_PAIRS if options.in_segments else None,
            **asdict(replace(options.config, threads=0))}))     # threads change no result
        if self.path is not None:
            self._check()
        if options.writes_bag:
            Messages()      # before a folder is made that has no use without them
        self._last = deque(maxlen=WARM_PAIRS + (SEGMENT_PAIRS if options.in_segments else 0))
        lowest = self.config.min_disparity
        self._video = [] if options.video is None else [VideoSink(
            options.video, min(max(source.rate(), RATES[0]), RATES[1]), lowest,
            lowest + self.config.disparities - 1)]

    def write(self, matched, item):
        """Pass a MatchedPair to all sinks; return None, or its Rejection by an internal error."""
        self._open()
        try:
            for sink in self.sinks:
                sink.add(matched, item)
        except (ValueError, OSError):
            raise
        except Exception as error:      # noqa: B902  an internal error ends no replay
            return rejection_of(error)
        self.written, self.log_time = self.written + 1, item.log_time
        if self._options.files and not self._options.writes_bag:
            self._last.append(item.position)
            write_whole(self.path / PROGRESS, json.dumps([*self._last]).encode())
        return None

    def finish(self):
        """Copy the messages after the last pair, which an earlier replay may have written."""
        if self.continued and self._source.caught_up:
            self._open()
        if self.bag_sink is not None:
            self.bag_sink.copy()

    def close(self):
        """Close all sinks, even if one of them raises an exception."""
        with ExitStack() as closing:
            for sink in self.sinks or ():
                closing.callback(sink.close)

    def written_positions(self):
        """Return the positions of the last few Items that are written; ValueError if damaged."""
        if not self.continued:
            return ()
        if not self._options.writes_bag:
            self._last.extend(_read_progress(self.path / PROGRESS))
        elif (self.path / METADATA).exists():
            try:
                with BagReader([self.path]) as bag:
                    if bag.losses:
                        raise ValueError(bag.losses[0])
                    self._last.extend(
                        (message.log_time, read_stamped(message)[0]) for message in bag.newest(
                            f'/{DISPARITY}', bag.end + 1, self._last.maxlen))
            except ValueError as error:
                raise ValueError(f'{error}; start over with --overwrite') from error
        return tuple(self._last)

    def _open(self):
        if self.sinks is not None:
            return
        if self.path is not None and not self.continued:
            self.path.mkdir(exist_ok=True)
            # What replays write and nothing else; last RECORD, which allows it.
            parts = [part for suffix in STORAGE_SUFFIXES.values()
                     for part in self.path.glob(f'*_*{suffix}')]
            names = UNFINISHED, DISPARITY, METADATA, CALIBRATION, PROGRESS, RECORD
            for path in (*parts, *(self.path / name for name in names)):
                remove(path)
            write_whole(self.path / RECORD, (json.dumps(self._record, indent=2) + '\n').encode())
        self.sinks = [FileSink(self.path, suffix) for suffix in self._options.files]
        if self._options.writes_bag:
            # After the files: for --resume a pair is written when the bag has it.
            self.bag_sink = BagSink(self.path, self._options, self._copies)
            self.sinks.append(self.bag_sink)
        self.sinks += self._video

    def _check(self):
        path, options = self.path, self._options
        if not path.parent.is_dir():
            raise ValueError(f'--output is {path}, but there is no folder {path.parent}')
        for bag in options.bags:
            if Path(bag).resolve().is_relative_to(path.resolve()):
                raise ValueError(f'--output is {path}, which holds the input {bag}')
        if not path.exists() or (path.is_dir() and not any(path.iterdir())):
            if options.resume:
                raise ValueError(f'--resume finds nothing to continue in {path}; leave it out')
            return
        made_by_replay = (path / RECORD).is_file()
        if not made_by_replay and (options.overwrite or options.resume):
            raise ValueError(f'{path} exists and was not made by replay (it has no {RECORD}); '
                             'give another folder')
        if not options.overwrite and not options.resume:
            raise ValueError(f'{path} exists; give another folder'
                             + (', --overwrite or --resume' if made_by_replay else ''))
        if options.resume:
            if (path / DISPARITY).is_symlink():
                raise ValueError(f'{path / DISPARITY} is a symbolic link, which is not followed; '
                                 'remove it, or start over with --overwrite')
            self._check_record()
            self.continued = True

    def _check_record(self):
        path, before = self.path / RECORD, None
        with suppress(ValueError):
            before = read_json(path)
        if not isinstance(before, dict):
            raise ValueError(f'{path} is damaged; start over with --overwrite')
        now = self._record
        different = [f'{name} ({before.get(name)}, now {now.get(name)})'
                     for name in {**before, **now} if before.get(name) != now.get(name)]
        if different:
            raise ValueError('--resume needs the options of the first run; different are '
                             + ', '.join(different))


def _read_progress(path):
    found = read_json(path) if path.exists() else []
    if not isinstance(found, list) or not all(
            isinstance(one, list) and [*map(type, one)] == [int, int] for one in found):
        raise ValueError(f'{path} is damaged; start over with --overwrite')
    return map(tuple, found)


class BagSink:
    """Writes a bag, a BagWriter, with the node's topics and copies of others."""

    def __init__(self, folder, options, copies):
        """Create or continue the bag of a folder; copies: CopiedMessages or None."""
        self.bag, self._copies = BagWriter(folder, options.storage), copies
        self._messages = Messages()
        self._results = ResultMessages(self._messages.make, options.settings)
        self._topics = topics_of(options.bag_results)
        self._copied = Counter({topic: self.bag.counts[topic] for topic in copies.topics}
                               if copies else {})       # by the replay that is continued

    def add(self, matched, item):
        """Write the results of a pair after the copies of earlier messages."""
        results = [(topic, kind, self._results.of(topic, matched))
                   for topic, kind in self._topics.items()]
        contents = [(topic, kind, self._messages.content(message))
                    for topic, kind, message in results if message is not None]
        self.copy(item.log_time)
        for topic, kind, content in contents:
            self.bag.write(f'/{topic}', kind, self._messages.typestore, content,
                           item.log_time)
        self.bag.commit()

    def copy(self, log_time=None):
        """Copy the messages that were recorded until a time in ns, None = all that are left."""
        for message, copying in self._copies.until(log_time) if self._copies else ():
            if self._copied[message.topic] > 0:
                self._copied[message.topic] -= 1
            else:
                self.bag.write(message.topic, copying.kind, copying.typestore,
                               copying.converted(message.content), message.log_time,
                               copying.qualities)

    def close(self):
        self.bag.close()


class FileSink:
    """Writes a disparity file for each pair, STAMP in ns or STAMP_1, and calibration.json."""

    def __init__(self, folder, suffix):
        """Create the subfolder of disparities; suffix: 'npy', 'pfm' or 'png'."""
        self._folder, self._suffix, self._calibration = folder, suffix, None
        self._place = folder / DISPARITY
        self._place.mkdir(exist_ok=True)

    def add(self, matched, item):
        """Write the disparities of a pair: float (R, C), px, not corrected by the offset."""
        if matched.pair.calibration != self._calibration:
            self._calibration = matched.pair.calibration
            write_whole(self._folder / CALIBRATION, (json.dumps(
                {'formula': 'Z = focal * baseline / (disparity - offset)',
                 **asdict(self._calibration),
                 'left': self._calibration.left._asdict()}, indent=2) + '\n').encode())
        again = f'_{item.repeated}' if item.repeated else ''
        path = self._place / f'{item.stamp:0{STAMP_DIGITS}d}{again}.{self._suffix}'
        write_disparity(path, matched.match.disparity)

    def close(self):
        """Do nothing: each file is complete."""
