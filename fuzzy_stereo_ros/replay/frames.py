# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Read folders of images and videos as a bag is read: as messages in the order of their stamps."""
from dataclasses import replace
from pathlib import Path

from fuzzy_stereo_ros.bags.reading import BagMessage, BagReader, BagTopic
from fuzzy_stereo_ros.bags.topics import RAW
from fuzzy_stereo_ros.pairs.frames import are_frames, Frames, SIDES
from fuzzy_stereo_ros.parameters.options import CameraOptions

TOPICS = {f'/{side}/image_rect': side for side in SIDES}
CALIBRATIONS = ('calib.txt',), ('left.yaml', 'right.yaml')      # in the folder of a recording


class FrameReader:
    """
    The interface of a BagReader, over Frames; the content of a message is a Frame.

    The frames were recorded at their stamps.
    """

    losses, msgtype = (), RAW       # of a BagReader; of a connection

    def __init__(self, paths, rate=None):
        """Find the frames; paths, rate, errors: as for Frames."""
        self._frames = Frames(paths, rate)
        self.names, self.begin, self.end = (
            self._frames.name, self._frames.begin, self._frames.end)
        self.topics = {topic: BagTopic(RAW, self._frames.counts[side])
                       for topic, side in TOPICS.items()}

    def __enter__(self):
        return self

    def __exit__(self, *error):
        pass

    def described(self, topics):
        """Return the two cameras in words; topics: StereoTopics."""
        return f'{self.names}, stamped by {self._frames.stamped_by}'

    def messages(self, topics, start=None, stop=None):
        """Yield each BagMessage of some topics, in order; start, stop: ns."""
        sides = {side: topic for topic, side in TOPICS.items() if topic in topics}
        for side, stamp, frame in self._frames.frames(sides, start, stop):
            yield BagMessage(sides[side], stamp, frame, self, self)

    def deserialize(self, frame, kind):
        """Return a Frame as it is."""
        return frame


def calibration_beside(paths):
    """Return the calibration files in the folder of a recording, None where it has none."""
    for names in CALIBRATIONS if len(paths) == 1 else ():
        files = [Path(paths[0]) / name for name in names]
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
    return opened.enter_context(FrameReader(options.bags, options.rate)), options
