# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Where the results of a replay go: into a bag, files, a video, the viewer; and their folder.

A sink has take(matched, logged), with each MatchedPair in the order of the bag until it raises
an exception, and close(), called in any case. All calls come from one thread, the one that made
it. An OSError of a sink, as of a full disk, or a ValueError ends the replay.
"""
from collections import Counter
from contextlib import ExitStack, suppress
from dataclasses import asdict, replace
import json
from pathlib import Path
import shutil

from fuzzy_stereo_ros.bags.reading import BagReader, read_stamped
from fuzzy_stereo_ros.bags.writing import BagWriter, Messages, METADATA, SUFFIXES, UNFINISHED
from fuzzy_stereo_ros.pairs.disparity_files import write_disparity
from fuzzy_stereo_ros.pairs.image_files import read_json, write_whole
from fuzzy_stereo_ros.pairs.result_messages import DISPARITY, ResultMessages, TOPICS
from fuzzy_stereo_ros.replay.options import SEGMENT_PAIRS, VIEWER, WARM_PAIRS
from fuzzy_stereo_ros.replay.source import rejection_of
from fuzzy_stereo_ros.views.rerun_view import RerunSink
from fuzzy_stereo_ros.views.video import RATES, VideoSink

CALIBRATION = 'calibration.json'
RECORD = 'replay.json'      # what the outputs were made of; it marks a folder as a replay's
STAMP_DIGITS = 19           # of ns since 1970, so that names stand in the order of time


class Outputs:
    """
    The sinks, made by the thread that uses them when there is something for them; their folder.

    config: the MatcherConfig of the images as they are matched. path: of the folder; None where
    no outputs go into one. continued: whether there are outputs in it that are to be continued.
    sinks: a list; None while there are none. bag_sink: the BagSink among them, or None. written:
    pairs that all of them took. logged: ns, of the last of these.
    """

    def __init__(self, options, source, copies):
        """
        Check the folder of ReplayOptions, and begin the views; nothing else is made yet.

        source: ReplaySource. copies: CopiedMessages or None.
        Raises ValueError where the folder may not be used so, and as `opened_views`.
        """
        self.config, self.sinks, self.bag_sink = options.scaled_config, None, None
        self.path = None if options.output is None else Path(options.output)
        self.continued, self.written, self.logged = False, 0, None
        self._options, self._source, self._copies = options, source, copies
        # What the outputs are made of; with the same they can be continued.
        self._record = json.loads(json.dumps({
            'bags': [Path(bag).name for bag in options.bags], **source.topics._asdict(),
            'calibration': source.calibration, 'start': options.start,
            'duration': options.duration, 'every': options.every, 'format': options.storage,
            'results': options.words, 'kept': sorted(copies.topics) if copies else [],
            'files': options.files, **options.settings,
            'segments': SEGMENT_PAIRS if options.in_segments else None,
            **asdict(replace(options.config, threads=0))}))     # they change no result
        if self.path is not None:
            self._check()
        self._views = opened_views(options, source)

    def put(self, matched, logged):
        """
        Give a MatchedPair to the sinks; logged: ns, when its last message was recorded.

        Returns the Rejection of a pair whose results cannot be made, None where they are written.
        """
        self._open()
        try:
            for sink in self.sinks:
                sink.take(matched, logged)
        except (ValueError, OSError):
            raise
        except Exception as error:      # noqa: B902  whatever it is, the next pair is written
            return rejection_of(error)
        self.written, self.logged = self.written + 1, logged
        return None

    def finish(self):
        """Copy what stands behind the last pair, which may be of a replay before."""
        if self.continued and self._source.resumed:
            self._open()
        if self.bag_sink is not None:
            self.bag_sink.copy()

    def close(self):
        """Close all sinks, whatever one of them raises."""
        with ExitStack() as closing:
            for sink in self.sinks or ():
                closing.callback(sink.close)

    def stamps_before(self):
        """
        Return the stamps of the last few pairs that are written already, ns, in order.

        They are in the bag, or else in files of the suffix that is written last.
        """
        count = WARM_PAIRS + (SEGMENT_PAIRS if self._options.in_segments else 0)
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

    def _open(self):
        if self.sinks is not None:
            return
        if self.path is not None and not self.continued:
            self.path.mkdir(exist_ok=True)
            self._clear()
            write_whole(self.path / RECORD, (json.dumps(self._record, indent=2) + '\n').encode())
        self.sinks = [FileSink(self.path, suffix) for suffix in self._options.files]
        if self._options.writes_bag:
            # After the files: --resume takes a pair for done that is in the bag.
            self.bag_sink = BagSink(self.path, self._options, self._copies)
            self.sinks.append(self.bag_sink)
        self.sinks += self._views

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
        now = self._record
        different = [f'{name} ({before.get(name)}, now {now.get(name)})'
                     for name in {**before, **now} if before.get(name) != now.get(name)]
        if different:
            raise ValueError('--resume goes on with the options of before; different are '
                             + ', '.join(different))


def opened_views(options, source):
    """
    Return the sinks that show pairs; their files are begun with the first one.

    options: ReplayOptions. source: the ReplaySource, whose stamps tell the rate of a video.
    Raises ValueError for a file that cannot be written so, and where rerun-sdk or a display is
    missing.
    """
    views = []
    if options.video is not None:
        rate, config = options.video_rate, options.scaled_config
        if rate is None:
            rate = min(max(source.rate(), RATES[0]), RATES[1])
        views.append(VideoSink(options.video, rate, config.min_disparity,
                               config.min_disparity + config.disparities - 1))
    if options.view is not None:
        views.append(RerunSink(None if options.view == VIEWER else options.view))
    return views


class BagSink:
    """
    A bag with the results under the node's topics, and copies of other topics.

    bag: the BagWriter.
    """

    def __init__(self, folder, options, copies):
        """
        Begin or continue the bag of a folder.

        options: ReplayOptions. copies: CopiedMessages or None.
        """
        self.bag, self._copies = BagWriter(folder, options.storage), copies
        self._messages = Messages()
        self._results = ResultMessages(self._messages.make, options.settings)
        self._topics = [one for word in TOPICS if word in options.words for one in TOPICS[word]]
        self._there = Counter()     # copies of a replay before
        if copies is not None:
            self._there.update({topic: self.bag.counts[topic] for topic in copies.topics})

    def take(self, matched, logged):
        """Write the results of a pair, behind the copies that stand before it."""
        results = [(topic, kind, self._results.of(topic, matched)) for topic, kind in self._topics]
        contents = [(topic, kind, self._messages.content(message))
                    for topic, kind, message in results if message is not None]
        self.copy(logged)
        for topic, kind, content in contents:
            self.bag.write(f'/{topic}', kind, self._messages.typestore, content, logged)
        self.bag.commit()

    def copy(self, logged=None):
        """Copy what was recorded until a time, ns, or all that is left."""
        for message, copying in self._copies.until(logged) if self._copies else ():
            if self._there[message.topic] > 0:
                self._there[message.topic] -= 1
            else:
                self.bag.write(message.topic, copying.kind, copying.typestore,
                               copying.converted(message.content), message.logged,
                               copying.qualities)

    def close(self):
        """Close the bag."""
        self.bag.close()


class FileSink:
    """A file of disparities for each pair, named by its stamp in ns, and calibration.json."""

    def __init__(self, folder, suffix):
        """
        Make the folder `disparity` in a folder that is there.

        suffix: 'npy', 'pfm' or 'png', as of pairs/disparity_files.py.
        """
        self._folder, self._suffix, self._calibration = folder, suffix, None
        self._place = folder / DISPARITY
        self._place.mkdir(exist_ok=True)

    def take(self, matched, logged=None):
        """Write the disparities of a pair: float (R, C), px, not corrected by the offset."""
        if matched.pair.calibration != self._calibration:
            self._calibration = matched.pair.calibration
            write_whole(self._folder / CALIBRATION, (json.dumps(
                {'formula': 'Z = focal * baseline / (disparity - offset)',
                 **asdict(self._calibration),
                 'left': self._calibration.left._asdict()}, indent=2) + '\n').encode())
        path = self._place / f'{matched.pair.stamp:0{STAMP_DIGITS}d}.{self._suffix}'
        write_disparity(path, matched.match.disparity)

    def close(self):
        """Do nothing: each file is whole."""
