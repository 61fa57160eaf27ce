# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Where the results of a replay go.

A sink has take(matched), called with each rig.Matched in the order of the bag until it raises an
exception, and close(), called in any case. All calls come from one thread, the one that made it.
An OSError of a sink, as of a full disk, or a ValueError ends the replay.
"""
from collections import Counter
from dataclasses import asdict
import json

from fuzzy_stereo_ros.bags.writing import BagFolder, Messages
from fuzzy_stereo_ros.pairs.disparity_files import write_disparity
from fuzzy_stereo_ros.pairs.whole_files import write_whole
from fuzzy_stereo_ros.result_topics import DISPARITY, ResultMessages, TOPICS

MARK = f'/{DISPARITY}'      # topic of which each pair that is done has a message
CALIBRATION = 'calibration.json'
STAMP_DIGITS = 19           # of ns since 1970, so that names stand in the order of time


class BagSink:
    """
    A bag with the results under the node's topics, and copies of other topics.

    bag: the BagFolder.
    """

    def __init__(self, folder, storage, words, settings, copies):
        """
        Begin or continue a bag.

        folder, storage: as of a BagFolder. words: keys of result_topics.TOPICS. settings: as of
        ResultMessages. copies: the Copies.
        """
        self.bag, self._logged = BagFolder(folder, storage), None
        self._messages, self._copies = Messages(), copies
        self._results = ResultMessages(self._messages.make, settings)
        topics = [one for word in TOPICS if word in words for one in TOPICS[word]]
        # The disparity comes last: where it is in the bag, all that belongs to it is.
        self._topics = sorted(topics, key=lambda one: one[0] == DISPARITY)
        done = self.bag.counts[MARK]
        self._there = Counter({topic: self.bag.counts[topic] for topic in copies.topics})
        self._there.update({f'/{topic}': self.bag.counts[f'/{topic}'] - done
                            for topic, _ in self._topics})

    def advance(self, copies, logged):
        """
        Copy messages that stand before the next pair.

        copies: BagMessages. logged: ns, when what is taken next was recorded.
        """
        for message in copies:
            copying = self._copies.of(message)
            self._write(message.topic, copying.kind, copying.typestore,
                        lambda: copying.converted(message.content),  # noqa: B023  called at once
                        message.logged, copying.qualities)
        self._logged = logged

    def take(self, matched):
        """Write the results of a pair."""
        for topic, kind in self._topics:
            self._write(f'/{topic}', kind, self._messages.typestore,
                        lambda: self._messages.content(  # called at once
                            self._results.of(topic, matched)),  # noqa: B023
                        self._logged)
        self.bag.commit()

    def close(self):
        """Close the bag."""
        self.bag.close()

    def _write(self, topic, kind, typestore, content, logged, qualities=()):
        """Write a message, content() its bytes, unless it is there from before."""
        if self._there[topic] > 0:
            self._there[topic] -= 1
        else:
            self.bag.write(topic, kind, typestore, content(), logged, qualities)


class FileSink:
    """
    A file of disparities for each pair, named by its stamp in ns, and calibration.json.

    replaced: how many files were replaced by that of a later pair with the same stamp.
    recalibrated: how often calibration.json was replaced by another one.
    """

    def __init__(self, folder, suffix):
        """
        Make the folder `disparity` in a folder that is there.

        suffix: 'npy', 'pfm' or 'png', as of pairs/disparity_files.py.
        """
        self._folder, self._suffix, self._calibration = folder, suffix, None
        self._place, self._newest, self.replaced = folder / DISPARITY, -1, 0
        self.recalibrated = 0
        self._place.mkdir(exist_ok=True)

    def take(self, matched):
        """Write the disparities of a pair: float (R, C), px, not corrected by the offset."""
        if matched.pair.calibration != self._calibration:
            self._calibration = matched.pair.calibration
            self._write_calibration()
        stamp = matched.pair.stamp
        path = self._place / f'{stamp:0{STAMP_DIGITS}d}.{self._suffix}'
        self.replaced += stamp <= self._newest and path.exists()
        self._newest = max(self._newest, stamp)
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
    """Return sentences on what FileSinks of one folder replaced."""
    remarks = []
    if any(sink.replaced for sink in sinks):
        remarks.append(f'{sinks[0].replaced} pairs have the stamp of an earlier one, whose files '
                       'theirs replaced')
    times = sum(sink.recalibrated for sink in sinks)    # the first finds what is replaced
    if times:
        remarks.append(f'the calibration changed, {times} times: {CALIBRATION} is that of the '
                       'last pairs and makes wrong metres of the files before')
    return remarks
