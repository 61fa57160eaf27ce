# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Read the frames of a stereo recording that is no bag: folders of images, patterns, and videos.

A frame has a stamp: from the name of its file, from its number and a rate, or from the video.
"""
from dataclasses import dataclass
from glob import glob
import heapq
from pathlib import Path
import re
from types import SimpleNamespace

import cv2
from fuzzy_stereo_ros.pairs.image_files import read_image
from fuzzy_stereo_ros.pairs.messages import set_stamp
from fuzzy_stereo_ros.pairs.stereo_pair import BadPair

IMAGE_SUFFIXES = '.png', '.jpg', '.jpeg', '.pgm', '.ppm', '.bmp', '.tif', '.tiff', '.webp'
VIDEOS = '.mp4', '.avi', '.mkv', '.mov', '.webm', '.m4v'
SIDES = 'left', 'right'
# Folders of the two cameras in the folder of a recording: ours, EuRoC's, KITTI's.
LAYOUTS = (('left', 'right'), ('cam0/data', 'cam1/data'), ('cam0', 'cam1'),
           ('image_0', 'image_1'), ('image_2', 'image_3'),
           ('image_00/data', 'image_01/data'), ('image_02/data', 'image_03/data'))
SECOND = 1_000_000_000
USUAL_RATE = 10.0           # frames per second, where neither names nor options say it
DIGITS_OF_NOW = {19: 1, 16: 1_000, 13: 1_000_000}      # digits of a time since 1970: its unit, ns
IN_SECONDS = re.compile(r'\d{9,10}\.\d+')
LAST_NUMBER = re.compile(r'\d+(?=\D*$)')


@dataclass
class Frame:
    """An image that is read when it is needed, with a header as messages have it."""

    header: SimpleNamespace
    read: object

    @classmethod
    def at(cls, stamp, read):
        """Return a Frame; stamp: ns. read(): returns its image, as `read_image`."""
        header = SimpleNamespace(stamp=SimpleNamespace(), frame_id='left')
        set_stamp(header, stamp)
        return cls(header, read)


class Frames:
    """
    The frames of two cameras.

    name: of both, for a sentence. counts: {side: number of frames}. begin, end: ns, of the first
    and the last frame. stamped_by: where the stamps are from, in words.
    """

    def __init__(self, paths, rate=None):
        """
        Find the frames, and read no image.

        paths: the folder of a recording that has one of LAYOUTS; a video with both images side by
        side; or for each camera a folder, a pattern such as 'left/*.png', a file, or a video.
        rate: frames per second, which replaces the stamps of names and videos.
        Raises ValueError if there are none.
        """
        if rate is not None and not rate > 0:
            raise ValueError(f'--rate is {rate:g}; allowed are numbers above 0')
        self.paths = side_paths(paths)
        self.name = ' and '.join(map(str, self.paths))
        self._videos = [path for path in self.paths if _is_video(path)]
        if self._videos:
            self._stamps, self.stamped_by = self._of_videos(rate)
        else:
            self._files = [_images_of(path) for path in self.paths]
            self._stamps, self.stamped_by = _stamps_of_names(self.name, self._files, rate)
        self.counts = dict(zip(SIDES, map(len, self._stamps)))
        self.begin = min(stamps[0] for stamps in self._stamps)
        self.end = max(stamps[-1] for stamps in self._stamps)

    def frames(self, sides=SIDES, start=None, stop=None):
        """Yield (side, stamp in ns, Frame) in the order of stamps, start <= stamp < stop."""
        streams = [self._side_by_side()] if len(self.paths) == 1 else [
            self._of_side(number) for number, side in enumerate(SIDES) if side in sides]
        for stamp, number, frame in heapq.merge(*streams, key=lambda one: one[0]):
            if stop is not None and stamp >= stop:
                return
            if SIDES[number] in sides and (start is None or stamp >= start):
                yield SIDES[number], stamp, frame

    def pairs(self):
        """Yield (stamp, left Frame, right Frame) of equal stamps."""
        waiting = {}
        for side, stamp, frame in self.frames():
            other = waiting.pop(stamp, None)
            if other is None:
                waiting = {stamp: frame}
            else:
                yield (stamp, *((other, frame) if side == 'right' else (frame, other)))

    def _of_side(self, number):
        """Yield (stamp, number of the side, Frame)."""
        readers = map(_constant, _video_frames(self.paths[number])) if self._videos else map(
            _reader, self._files[number])
        for stamp, read in zip(self._stamps[number], readers):
            yield stamp, number, Frame.at(stamp, read)

    def _side_by_side(self):
        """Yield the same of both halves of a video."""
        for stamp, image in zip(self._stamps[0], _video_frames(self.paths[0])):
            half = image.shape[1] // 2
            yield stamp, 0, Frame.at(stamp, _constant(image[:, :half]))
            yield stamp, 1, Frame.at(stamp, _constant(image[:, half:2 * half]))

    def _of_videos(self, rate):
        """Return the stamps of both sides, and where they are from."""
        stamps = []
        for path in self.paths:
            video = cv2.VideoCapture(str(path))
            count, own = (video.get(what) for what in (cv2.CAP_PROP_FRAME_COUNT,
                                                       cv2.CAP_PROP_FPS))
            opened = video.isOpened() and video.grab()
            video.release()
            if not opened:
                raise ValueError(f'{path} is not a video that OpenCV can read')
            stamps.append([round(number * SECOND / (rate or own or USUAL_RATE))
                           for number in range(max(1, round(count)))])
        return (stamps * 2)[:2], 'the rate of --rate' if rate else 'the rate of the video'


def side_paths(paths):
    """Return the paths of both cameras, or of one video; ValueError if they are none."""
    if len(paths) == 1 and Path(paths[0]).is_dir():
        there = _layouts_of(paths[0])
        if len(there) != 1:
            several = '; '.join(' and '.join(map(str, found)) for found in there)
            raise ValueError(f'{paths[0]} holds several recordings, {several}; name the two '
                             'folders of one' if there else
                             f'{paths[0]} holds the images of one camera, or no folders left and '
                             'right; name two folders')
        return there[0]
    if len(paths) > 2 or (len(paths) == 1 and not _is_video(paths[0])):
        raise ValueError(f'{len(paths)} images or folders are given; allowed are a recording, a '
                         "video, or two folders, videos or patterns in quotes: 'left/*.png' "
                         "'right/*.png'")
    if len({_is_video(path) for path in paths}) > 1:
        raise ValueError(f"{' and '.join(map(str, paths))}: one is a video, the other is not")
    return tuple(paths)


def are_frames(paths):
    """Return whether paths name images or videos: those that are no bags."""
    return all(_is_video(path) or _is_pattern(path) or Path(path).suffix.lower() in IMAGE_SUFFIXES
               or (Path(path).is_dir() and bool(_listed(path) or _layouts_of(path)))
               for path in paths)


def are_pairs(paths):
    """Return whether paths are frames of two cameras."""
    return are_frames(paths) and (
        len(paths) > 1 or _is_video(paths[0]) or len(_layouts_of(paths[0])) == 1)


def _layouts_of(folder):
    pairs = [tuple(Path(folder) / side for side in layout) for layout in LAYOUTS]
    return [pair for pair in pairs if all(side.is_dir() and _listed(side) for side in pair)]


def _is_video(path):
    return Path(path).suffix.lower() in VIDEOS


def _is_pattern(path):
    return any(sign in str(path) for sign in '*?[') and not Path(path).exists()


def _listed(path):
    """Return the image files of a folder, of a pattern, or a file alone."""
    found = Path(path).iterdir() if Path(path).is_dir() else map(Path, glob(str(path))) \
        if _is_pattern(path) else [Path(path)]
    return sorted(one for one in found if one.suffix.lower() in IMAGE_SUFFIXES and one.is_file())


def _images_of(path):
    found = _listed(path)
    if not found:
        raise ValueError(f"{path} has no images ({', '.join(IMAGE_SUFFIXES)})")
    return found


def _stamps_of_names(name, files, rate):
    """Return the stamps of files of both sides, which are sorted by them; and their origin."""
    if rate is None:
        stamps = [[_time_in(path.stem) for path in side] for side in files]
        if None not in (*stamps[0], *stamps[1]):
            return _sorted(files, stamps), 'the times in the names'
    numbers = [[found and int(found[0]) for found in (
        LAST_NUMBER.search(path.stem) for path in side)] for side in files]
    if any(None in side or len(set(side)) < len(side) for side in numbers) or not (
            set(numbers[0]) & set(numbers[1])):
        if len(files[0]) != len(files[1]):
            raise ValueError(f'{name}: {len(files[0])} and {len(files[1])} images, whose names '
                             'have no numbers that tell which belong together')
        numbers = [range(len(side)) for side in files]
    origin = f'frame numbers at {rate or USUAL_RATE:g} per second'
    stamps = [[round(number * SECOND / (rate or USUAL_RATE)) for number in side]
              for side in numbers]
    return _sorted(files, stamps), origin if rate else f'{origin} (see --rate)'


def _sorted(files, stamps):
    """Sort the files of both sides by their stamps in place, and return the stamps."""
    for side, own in zip(files, stamps):
        order = sorted(range(len(own)), key=own.__getitem__)
        side[:], own[:] = [side[place] for place in order], [own[place] for place in order]
    return stamps


def _time_in(stem):
    """Return the time since 1970 in the name of a file, ns, None if it is none."""
    if IN_SECONDS.fullmatch(stem):
        whole, part = stem.split('.')
        return int(whole) * SECOND + int(part[:9].ljust(9, '0'))
    unit = DIGITS_OF_NOW.get(len(stem)) if stem.isdecimal() and stem[0] != '0' else None
    return unit and int(stem) * unit


def _reader(path):
    def read():
        try:
            return read_image(path)
        except ValueError as error:
            raise BadPair('damaged image', str(error)) from None
    return read


def _constant(image):
    return lambda: image


def _video_frames(path):
    """Yield the frames of a video: uint8 (R, C, 3) BGR."""
    video = cv2.VideoCapture(str(path))
    try:
        while True:
            there, image = video.read()
            if not there:
                return
            yield image
    finally:
        video.release()
