# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a replay is asked for, checked against the bags before anything is written."""
from collections import deque
import math

from fuzzy_stereo_ros.bags.copying import Copies
from fuzzy_stereo_ros.bags.reading import BagReader, decoded, slashed
from fuzzy_stereo_ros.bags.stereo_topics import find_stereo_topics
from fuzzy_stereo_ros.bags.writing import BagFolder
from fuzzy_stereo_ros.pairs.camera_files import read_camera, rectified_cameras
from fuzzy_stereo_ros.pairs.messages import read_image, stamp_of
from fuzzy_stereo_ros.parameters.camera_options import CAMERA, given_calibration
from fuzzy_stereo_ros.replay.sinks import MARK
from fuzzy_stereo_ros.replay.source import Selection
from fuzzy_stereo_ros.result_topics import DISPARITY, TOPICS

SECOND = 1_000_000_000
WARM_PAIRS = 8      # matched again before what is new: frames that are averaged at the most


def chosen_topics(bags, left, right, rectify):
    """Return the StereoTopics of a BagReader; left, right: names or None; ValueError."""
    left, right = (one if one is None else slashed(one) for one in (left, right))
    return find_stereo_topics(bags.names, bags.topics, left, right, rectify)


def chosen_calibration(bags, topics, arguments, rectify):
    """
    Return ((left, right), sentence): two CameraInfo for all pairs, and where they come from.

    None instead of the two where they come by their topics. topics: StereoTopics of a BagReader.
    arguments: as of camera_options. rectify: whether the images are raw.
    Raises ValueError where there is no calibration, or none for what is asked.
    """
    missing = [image for image, info in (topics[:2], topics[2:]) if info is None]
    if not missing and all(getattr(arguments, name) is None for name in CAMERA):
        return None, f'{topics.left_info} and {topics.right_info}'
    purpose = 'a calibration that is not that of the bag'
    if missing:
        purpose = f"{bags.names}, without camera_info beside {' and '.join(missing)},"
    shape = _first_shape(bags, topics.left)
    calibration = given_calibration(arguments, shape, ('focal', 'baseline'), purpose)
    files = arguments.camera_info
    if files is not None and len(files) == 2:
        return tuple(map(read_camera, files)), ' and '.join(files)
    if rectify:
        raise ValueError('--rectify and --crop need the calibration of both raw cameras: those '
                         'in the bag, or --camera-info LEFT.yaml RIGHT.yaml')
    cameras = tuple(rectified_cameras(calibration, *shape).values())
    if files is not None:
        return cameras, files[0]
    return cameras, (
        f'focal length {arguments.focal:g} px, baseline {arguments.baseline:g} m and the centre '
        + ('assumed in the middle of the image' if arguments.principal_point is None else
           'at {:g}, {:g}'.format(*arguments.principal_point)))


def _first_shape(bags, topic):
    """Return (rows, columns) of the first image of a topic; ValueError where it is none."""
    return read_image(decoded(next(bags.messages([topic])))).shape[:2]


def chosen_part(bags, start, duration, every, done=()):
    """
    Return the Selection of a BagReader.

    start, duration: s from its begin, None is all. every: as of a Selection. done: likewise.
    Raises ValueError for what is not in the bag.
    """
    length = (bags.end - bags.begin) / SECOND
    if start is not None and not 0 <= start <= length:
        raise ValueError(f'--start is {start:g}; {bags.names} is {length:.3f} s long')
    if duration is not None and not (math.isfinite(duration) and duration > 0):
        raise ValueError(f'--duration is {duration:g}; allowed are numbers above 0')
    if every < 1:
        raise ValueError(f'--every is {every}; allowed are whole numbers from 1')
    first = bags.begin + round((start or 0.0) * SECOND)
    return Selection(None if start is None else first,
                     None if duration is None else first + round(duration * SECOND), every, done)


def expected_pairs(bags, topics, selection):
    """Return about how many pairs of a BagReader a Selection has, for a bar."""
    first = bags.begin if selection.start is None else selection.start
    last = bags.end if selection.stop is None else min(selection.stop, bags.end)
    share = (last - first) / max(bags.end - bags.begin, 1)
    return math.ceil(bags.topics[topics.left].messages * min(max(share, 0), 1) / selection.every)


def chosen_copies(bags, names, words):
    """
    Return the Copies of a BagReader.

    names: of topics; an empty list is all, None is none. words: of the results, whose topics are
    not copied.
    Raises ValueError for a topic that is not there, or a result.
    """
    results = {f'/{topic}' for word in words for topic, _ in TOPICS[word]}
    wanted = [slashed(name) for name in names or ()]
    if names == []:
        wanted = [topic for topic in bags.topics if topic not in results]
    for topic in wanted:
        if topic not in bags.topics:
            raise ValueError(f'--keep names {topic}, which is not in {bags.names}; there are '
                             f"{', '.join(sorted(bags.topics))}")
        if topic in results:
            raise ValueError(f'--keep names {topic}, under which the results are written')
    return Copies(bags, wanted)


def done_before(path, storage, suffixes, pairs=WARM_PAIRS):
    """
    Return (logged, stamp) of the last few pairs of an interrupted replay.

    path: of the folder, whose unfinished bag is made readable. storage: of the bag, None where
    there is none. suffixes: of the files of disparities, in the order in which those of a pair
    are written. pairs: how many, if there are so many.
    logged is None where only files are.
    """
    if storage is None:
        stamps = sorted(int(file.stem) for file in (path / DISPARITY).glob(f'*.{suffixes[-1]}')
                        if file.stem.isdecimal())
        return tuple((None, stamp) for stamp in stamps[-pairs:])
    if not BagFolder(path, storage).counts[MARK]:
        return ()
    with BagReader([path]) as bag:
        seconds, found = 1, ()
        while len(found) < pairs:
            start = bag.end - seconds * SECOND
            found = tuple(deque(((one.logged, stamp_of(decoded(one).header))
                                 for one in bag.messages([MARK], start)), pairs))
            if start <= bag.begin:
                break
            seconds *= 4
        return found
