# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Where the results of a replay go: into a bag, files, a video, the viewer.

A sink has take(matched, logged), with each MatchedPair in the order of the bag until it raises
an exception, and close(), called in any case. All calls come from one thread, the one that made
it. An OSError of a sink, as of a full disk, or a ValueError ends the replay.
"""
from collections import Counter
from contextlib import ExitStack
from dataclasses import asdict
import json

from fuzzy_stereo_ros.bags.copying import Copies
from fuzzy_stereo_ros.bags.reading import slashed
from fuzzy_stereo_ros.bags.writing import BagWriter, Messages
from fuzzy_stereo_ros.pairs.disparity_files import write_disparity
from fuzzy_stereo_ros.pairs.result_messages import DISPARITY, ResultMessages, TOPICS
from fuzzy_stereo_ros.pairs.whole_files import write_whole
from fuzzy_stereo_ros.replay.options import VIEWER
from fuzzy_stereo_ros.replay.source import refusal_of
from fuzzy_stereo_ros.views.rerun_view import RerunSink
from fuzzy_stereo_ros.views.video import RATES, VideoSink

CALIBRATION = 'calibration.json'
STAMP_DIGITS = 19           # of ns since 1970, so that names stand in the order of time


class Outputs:
    """
    The sinks, made by the thread that uses them when there is something for them.

    config: the MatcherConfig of the images as they are matched. sinks: a list; None while there
    are none. written: pairs that all of them took. logged: ns, of the last of these.
    """

    def __init__(self, options, folder, source, copies, views):
        """
        Make nothing yet.

        options: ReplayOptions. folder: OutputFolder. source: ReplaySource. copies:
        CopiedMessages or None. views: sinks that are there already.
        """
        self.config, self.sinks = options.scaled_config, None
        self.written, self.logged = 0, None
        self._options, self._folder, self._source = options, folder, source
        self._copies, self._views = copies, views

    def put(self, matched, logged):
        """
        Give a MatchedPair to the sinks; logged: ns, when its last message was recorded.

        Returns the Refusal of a pair whose results cannot be made, None where they are written.
        """
        self._open()
        try:
            for sink in self.sinks:
                sink.take(matched, logged)
        except (ValueError, OSError):
            raise
        except Exception as error:      # noqa: B902  whatever it is, the next pair is written
            return refusal_of(error)
        self.written, self.logged = self.written + 1, logged
        return None

    def finish(self):
        """Copy what stands behind the last pair, which may be of a replay before."""
        if self._folder.continued and self._source.resumed:
            self._open()
        for sink in self.sinks or ():
            if isinstance(sink, BagSink):
                sink.copy()

    def close(self):
        """Close all sinks, whatever one of them raises."""
        with ExitStack() as closing:
            for sink in self.sinks or ():
                closing.callback(sink.close)

    def _open(self):
        if self.sinks is not None:
            return
        self._folder.begin()
        self.sinks = [FileSink(self._folder.path, suffix) for suffix in self._options.files]
        if self._options.writes_bag:
            # After the files: --resume takes a pair for done that is in the bag.
            self.sinks.append(BagSink(self._folder.path, self._options, self._copies))
        self.sinks += self._views


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


class CopiedMessages:
    """
    Messages to be copied, of a BagReader that nobody else reads.

    topics: names, all of a bag of ROS 2.
    """

    def __init__(self, options, bags, source):
        """
        Choose the topics; source: the ReplaySource, whose part of the bags is copied.

        Raises ValueError for a topic that is not there, is a result, or cannot be copied.
        """
        results = {f'/{topic}' for word in options.words for topic, _ in TOPICS[word]}
        self.topics = [slashed(name) for name in options.keep]
        for topic in self.topics:
            if topic not in bags.topics:
                raise ValueError(f'--keep names {topic}, which is not in {bags.names}; there are '
                                 f"{', '.join(sorted(bags.topics))}")
            if topic in results:
                raise ValueError(f'--keep names {topic}, under which the results are written')
        if not self.topics:
            self.topics = [topic for topic in bags.topics if topic not in results]
        self._copies = Copies(bags, self.topics)
        self._messages = bags.messages(self.topics, source.start, source.stop)
        self._next = None

    def until(self, logged):
        """Yield (BagMessage, its Copying) up to a time, ns, or all that is left; DamagedBag."""
        while True:
            self._next = self._next or next(self._messages, None)
            if self._next is None or (logged is not None and self._next.logged > logged):
                return
            message, self._next = self._next, None
            yield message, self._copies.of(message)


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
    """
    A file of disparities for each pair, named by its stamp in ns, and calibration.json.

    recalibrated: how often calibration.json was replaced by another one.
    """

    def __init__(self, folder, suffix):
        """
        Make the folder `disparity` in a folder that is there.

        suffix: 'npy', 'pfm' or 'png', as of pairs/disparity_files.py.
        """
        self._folder, self._suffix, self._calibration = folder, suffix, None
        self._place, self.recalibrated = folder / DISPARITY, 0
        self._place.mkdir(exist_ok=True)

    def take(self, matched, logged=None):
        """Write the disparities of a pair: float (R, C), px, not corrected by the offset."""
        if matched.pair.calibration != self._calibration:
            self._calibration = matched.pair.calibration
            self._write_calibration()
        path = self._place / f'{matched.pair.stamp:0{STAMP_DIGITS}d}.{self._suffix}'
        write_disparity(path, matched.match.disparity)

    def close(self):
        """Do nothing: each file is whole."""

    def _write_calibration(self):
        path, content = self._folder / CALIBRATION, (json.dumps(
            {'formula': 'Z = focal * baseline / (disparity - offset)',
             **asdict(self._calibration),
             'left': self._calibration.left._asdict()}, indent=2) + '\n').encode()
        self.recalibrated += path.exists() and path.read_bytes() != content
        write_whole(path, content)


def remarks_on_files(sinks):
    """Return sentences on what the files of sinks no longer say."""
    times = sum(sink.recalibrated for sink in sinks if isinstance(sink, FileSink))
    if not times:       # of several FileSinks the first one finds what is replaced
        return []
    return [f'the calibration changed, {times} times: {CALIBRATION} is that of the last pairs and '
            'makes wrong metres of the files before']
