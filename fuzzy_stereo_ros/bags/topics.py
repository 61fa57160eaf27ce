# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Find the topics of the two cameras in a bag, by their types and names."""
import re
from typing import NamedTuple

RAW, COMPRESSED = 'sensor_msgs/msg/Image', 'sensor_msgs/msg/CompressedImage'
INFO = 'sensor_msgs/msg/CameraInfo'
SIDE_WORDS = ('left', 'right'), ('infra1', 'infra2'), ('cam0', 'cam1')
DEPTH_SUFFIX = '/compressedDepth'   # of CompressedImages that are no camera images


class StereoTopics(NamedTuple):
    """The four topics; left_info and right_info are None without a calibration."""

    left: str
    left_info: str | None
    right: str
    right_info: str | None

    @property
    def raw_by_name(self):
        """Whether the name of an image topic says raw and not rect, such as image_raw."""
        names = (one.removesuffix('/compressed').split('/')[-1] for one in (self.left, self.right))
        return any('raw' in name and 'rect' not in name for name in names)


def find_stereo_topics(name, topics, left=None, right=None, rectify=False):
    """
    Return the StereoTopics of a bag.

    name: of the bag. topics: {name: (type, number of messages)}. left, right: names of the image
    topics, None = found by name. rectify: prefer raw images to rectified ones.
    Raises ValueError, with the topics there are, if no pair of cameras or several are found.
    """
    images = {topic for topic, (kind, _) in topics.items()
              if kind in (RAW, COMPRESSED) and not topic.endswith(DEPTH_SUFFIX)}
    if not images:
        raise ValueError(f'{name} has no images; it holds {_listed(topics)}')
    for side, topic in (('left', left), ('right', right)):
        if topic is not None and topic not in images:
            raise ValueError(f'--{side} is {topic}, which is no topic of images in {name}; '
                             f'there are {_listed(images)}')
    if left is not None and right is not None:
        if left == right:
            raise ValueError(f'--left and --right are both {left}; a pair has two cameras')
        chosen = left, right
    else:
        chosen = _only_pair(name, topics, images, left, right, rectify)
    infos = [_info_of(topic, topics) for topic in chosen]
    return StereoTopics(chosen[0], infos[0], chosen[1], infos[1])


def _only_pair(name, topics, images, left, right, rectify):
    """Return the only pair of image topics whose names differ just in a pair of SIDE_WORDS."""
    twins = {one: next((twin for twin in _twins(one) if twin in images), None)
             for one in sorted(images)}
    pairs = [(one, twin) for one, twin in twins.items() if twin and one not in twins.values()
             and left in (None, one) and right in (None, twin)]
    if not pairs:
        if len(images) == 1:
            raise ValueError(f'{name} has images of one camera only, {_listed(images)}; a pair '
                             'needs two')
        words = ', '.join('/'.join(pair) for pair in SIDE_WORDS)
        raise ValueError(f'no two image topics of {name} differ only in {words}; choose with '
                         f'--left and --right among {_listed(images)}')
    for preferred in (
            lambda pair: topics[pair[0]][0] == RAW and topics[pair[1]][0] == RAW,
            lambda pair: all(_info_of(topic, topics) for topic in pair),
            lambda pair: ('rect' in _base(pair[0], topics).split('/')[-1]) is not rectify):
        pairs = [pair for pair in pairs if preferred(pair)] or pairs
    if len(pairs) > 1:
        several = '; '.join(' and '.join(pair) for pair in pairs)
        raise ValueError(f'{name} has several pairs of image topics: {several}; choose one with '
                         '--left')
    return pairs[0]


def _twins(topic):
    """Yield possible names of the right camera's topic; words near the end, not of rigs, first."""
    starts = []
    for left, right in SIDE_WORDS:
        words = list(re.finditer(f'(?<![a-z0-9])({left}|{right})(?![a-z0-9])', topic))
        if words and words[-1][0] == left:
            starts += [(word.start(), left, right) for word in words if word[0] == left]
    for start, left, right in sorted(starts, reverse=True):
        yield topic[:start] + re.sub(f'(?<![a-z0-9]){left}(?![a-z0-9])', right, topic[start:])


def _base(image, topics):
    return image.removesuffix('/compressed') if topics[image][0] == COMPRESSED else image


def _info_of(image, topics):
    """Return the CameraInfo topic in the namespace of an image topic or below it, or None."""
    base = _base(image, topics)
    infos = [topic for topic, (kind, _) in topics.items() if kind == INFO]
    for namespace in (base.rsplit('/', 1)[0], base):
        if f'{namespace}/camera_info' in infos:
            return f'{namespace}/camera_info'
        in_namespace = [info for info in infos if info.rsplit('/', 1)[0] == namespace]
        if len(in_namespace) == 1:
            return in_namespace[0]
    return None


def _listed(topics):
    if isinstance(topics, dict):
        return ', '.join(f'{topic} ({kind}, {number})'
                         for topic, (kind, number) in sorted(topics.items()))
    return ', '.join(sorted(topics))
