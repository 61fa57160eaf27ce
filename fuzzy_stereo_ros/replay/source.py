# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Read the pairs of bags in order: find the topics, synchronise, select, calibrate.

Folders of images and videos are read as bags are: as messages in the order of their stamps.
"""
from collections import Counter
from contextlib import suppress
from dataclasses import replace
from itertools import islice, pairwise
import math
import os
from pathlib import Path
from statistics import median
from typing import NamedTuple

from fuzzy_stereo_ros.bags.reading import (
    BagMessage, BagReader, BagTopic, DamagedBag, read_stamped, slashed, text_of)
from fuzzy_stereo_ros.bags.topics import find_stereo_topics, RAW
from fuzzy_stereo_ros.pairs.frames import are_frames, Frames, SECOND, USUAL_RATE
from fuzzy_stereo_ros.pairs.messages import read_image
from fuzzy_stereo_ros.pairs.pair_reader import PairReader
from fuzzy_stereo_ros.pairs.stereo_pair import BadPair, SIDES, StereoPair
from fuzzy_stereo_ros.pairs.synchroniser import Synchroniser
from fuzzy_stereo_ros.parameters.options import CameraOptions
from fuzzy_stereo_ros.parameters.table import sync_tolerance
from fuzzy_stereo_ros.replay.options import READING

RATED_IMAGES = 31       # images whose stamps give the rate
TOPICS = {f'/{side}/image_rect': side for side in SIDES}       # of folders and videos
# In the folder that holds a recording; the last is of KITTI's drives of a day.
CALIBRATIONS = (('calib.txt',), ('left.yaml', 'right.yaml'), ('calib_cam_to_cam.txt',),
                ('../calib_cam_to_cam.txt',))


class Rejection(NamedTuple):
    """Why a pair is not matched: the reason it is counted by, and a sentence."""

    reason: str
    sentence: str


class Item(NamedTuple):
    """A pair of a bag, or a damaged message, which has no stamp and no number."""

    log_time: int               # ns, when the last of its messages was recorded
    stamp: int | None = None    # ns
    number: int | None = None   # of the selected pairs, from 0
    pair: StereoPair | Rejection | None = None
    went_back: bool = False     # the stamp is smaller than the one of an earlier pair
    repeated: int = 0           # how many earlier pairs have this stamp
    written: bool = False       # by the replay that is resumed; the pair only warms up

    @property
    def position(self):
        """Where the pair is in the bag; stamps alone repeat where a recording was looped."""
        return self.log_time, self.stamp


class ReplaySource:
    """
    Reads the pairs of bags as the node reads topics; for one thread.

    topics: StereoTopics. cameras, calibration: both in words. start, stop: ns, the recorded
    time that is read, None = no bound. synchroniser: the Synchroniser, with its counts.
    caught_up: whether all pairs that are written already have been read.
    """

    def __init__(self, options, bags):
        """Choose topics, calibration and time, by at most one image; ValueError without them."""
        self._options, self._bags, settings = options, bags, options.settings
        left, right = (name and slashed(name) for name in (options.left, options.right))
        self.topics = find_stereo_topics(bags.names, bags.topics, left, right,
                                         settings['rectify'])
        self._infos, self.calibration = _calibration(options, bags, self.topics)
        self.cameras = f'{bags.names}, stamped by {bags.stamped_by}' if isinstance(
            bags, FrameReader) else f'{self.topics.left} and {self.topics.right}'
        length = (bags.end - bags.begin) / SECOND
        if options.start is not None and not 0 <= options.start <= length:
            raise ValueError(f'--start is {options.start:g}; {bags.names} is {length:.3f} s long')
        first = bags.begin + round((options.start or 0.0) * SECOND)
        self.start = None if options.start is None else first
        self.stop = (None if options.duration is None or options.duration > length else
                     first + round(options.duration * SECOND))
        self._read = PairReader(*(settings[name] for name in READING)).read
        queued, self._held = self.topics, ()
        if self._infos is not None:
            queued = self.topics.left, self.topics.right
        elif settings['cache_camera_info']:
            self._held = self.topics.left_info, self.topics.right_info
        self.synchroniser = Synchroniser(queued, settings['queue_size'],
                                         sync_tolerance(settings), self._held)
        self._selected, self._went_back, self._stamps = 0, False, Counter()
        self.caught_up = True

    def expected_pairs(self):
        """Return an estimate of the number of selected pairs."""
        first = self._bags.begin if self.start is None else self.start
        last = self._bags.end if self.stop is None else min(self.stop, self._bags.end)
        share = (last - first) / max(self._bags.end - self._bags.begin, 1)
        messages = self._bags.topics[self.topics.left].messages
        return math.ceil(messages * min(max(share, 0), 1) / self._options.every)

    def rate(self):
        """Return the selected pairs per second, by the stamps of the first left images."""
        stamps = []
        with suppress(DamagedBag, BadPair):     # the replay reports it later
            for message in islice(self._messages([self.topics.left]), RATED_IMAGES):
                stamps.append(read_stamped(message)[0])
        intervals = [after - before for before, after in pairwise(stamps) if after > before]
        return SECOND / median(intervals) / self._options.every if intervals else USUAL_RATE

    def items(self, done=()):
        """
        Yield each Item; raises DamagedBag if a bag can be read no further.

        done: positions of the last few Items that are written already, in order. Earlier ones are
        skipped; these few are read again, so that new pairs start warm.
        """
        self._done, self._skipping, self.caught_up = done, bool(done), not done
        for topic in self._held if self.start is not None else ():
            for message in self._bags.newest(topic, self.start):
                self.synchroniser.add(topic, *read_stamped(message))
        log_time = self._bags.begin
        for message in self._messages(self.synchroniser.topics):
            log_time = message.log_time
            try:
                found = self.synchroniser.add(message.topic, *read_stamped(message))
            except BadPair as bad:
                yield Item(log_time, pair=rejection_of(bad))
                continue
            yield from self._selected_of(log_time, found)
        yield from self._selected_of(log_time, self.synchroniser.finish())
        self.synchroniser.clear()

    def _messages(self, topics):
        return self._bags.messages(topics, self.start, self.stop)

    def _selected_of(self, log_time, found):
        """Yield the Item of each MatchedSet that is selected and not skipped."""
        for one in found:
            number, rest = divmod(self._selected, self._options.every)
            self._selected += 1
            self._went_back |= one.went_back
            if rest:
                continue
            item = Item(log_time, one.stamp, number, repeated=self._stamps[one.stamp],
                        written=not self.caught_up)
            self._stamps[one.stamp] += 1
            if item.written:
                self._skipping = self._skipping and item.position != self._done[0]
                self.caught_up = not self._skipping and item.position == self._done[-1]
                if self._skipping:
                    continue
            yield item._replace(pair=self._pair(one.messages), went_back=self._went_back)
            self._went_back = False

    def _pair(self, messages):
        if self._infos is not None:
            messages = messages[0], self._infos[0], messages[1], self._infos[1]
        try:
            return self._read(*messages)
        except Exception as error:      # noqa: B902  an internal error ends no replay
            return rejection_of(error)


def first_pairs(options, bags, count):
    """Return the first StereoPairs of a recording, at most `count`; errors: ReplaySource."""
    pairs = (item.pair for item in ReplaySource(options, bags).items()
             if isinstance(item.pair, StereoPair))
    return list(islice(pairs, count))


def rejection_of(error):
    """Return the Rejection of a pair that raised an exception."""
    if isinstance(error, ValueError):
        return Rejection(getattr(error, 'reason', 'match'), str(error))
    return Rejection('internal error', f'internal error, {type(error).__name__}: {text_of(error)}')


def _calibration(options, bags, topics):
    """Return both CameraInfo, None if each pair has its own, and their origin; ValueError."""
    missing = [image for image, info in (topics[:2], topics[2:]) if info is None]
    if not missing and not options.cameras.given:
        return None, f'{topics.left_info} and {topics.right_info}'
    rectifies = options.settings['rectify'] or options.settings['crop']
    purpose = 'a calibration that is not that of the bag'
    if missing:
        purpose = f"{bags.names}, without camera_info beside {' and '.join(missing)},"
        if not (options.cameras.given or rectifies or {'depth', 'points2'} & {*options.results}):
            return (None, None), 'nothing: disparities are without metres'
    _, first = read_stamped(next(bags.messages([topics.left])))
    shape = read_image(first).shape[:2]
    return options.cameras.cameras(shape, purpose, rectifies, bags.paths)


class FrameReader(Frames):
    """Frames, recorded at their stamps, as a BagReader; the content of a message is a Frame."""

    losses, msgtype = (), RAW       # of a BagReader; of a connection

    def __init__(self, paths, rate=None):
        """Find the frames; paths, rate, errors: as for Frames."""
        super().__init__(paths, rate)
        self.names = self.name
        self.topics = {topic: BagTopic(RAW, self.counts[side]) for topic, side in TOPICS.items()}

    def messages(self, topics, start=None, stop=None):
        """Yield each BagMessage of some topics, in order; start, stop: ns."""
        sides = {side: topic for topic, side in TOPICS.items() if topic in topics}
        for side, stamp, frame in self.frames(sides, start, stop):
            yield BagMessage(sides[side], stamp, frame, self, self)

    def deserialize(self, frame, kind):
        """Return a Frame as it is."""
        return frame


def calibration_beside(paths):
    """Return the calibration files in the folder that holds a recording, None without."""
    folder = paths[0] if len(paths) == 1 else os.path.commonpath(map(os.path.abspath, paths))
    for names in CALIBRATIONS:
        files = [Path(folder, name) for name in names]
        if all(file.is_file() for file in files):
            return tuple(map(str, files))
    return None


def opened_recording(options, opened):
    """Return the reader of bags or frames, and ReplayOptions with a calibration beside them."""
    if not are_frames(options.bags):
        if options.rate is not None:
            raise ValueError('--rate is for folders and videos; a bag has the times of recording')
        return opened.enter_context(BagReader(options.bags)), options
    for name in ('keep', 'left', 'right'):
        if getattr(options, name) is not None:
            raise ValueError(f'--{name} names topics of a bag; images and videos have none')
    if not options.cameras.given:
        options = replace(options, cameras=CameraOptions(calibration_beside(options.bags)))
    return FrameReader(options.bags, options.rate), options
