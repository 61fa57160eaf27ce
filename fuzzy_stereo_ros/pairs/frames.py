# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Read the frames of a stereo recording that is no bag: folders of images, patterns, and videos.

A frame has a stamp: from the name of its file, from its number and a rate, or from the video.

Images of two cameras are a pair where their names say the same, apart from what names the camera.
Names are read as far as one that shows equal frames: the times in them; the names; the names
without the words for the camera; the numbers in them; and those that change. Zeros before numbers
say nothing. Names that never show equal frames make no pair.
"""
from glob import glob
import heapq
from itertools import pairwise
from pathlib import Path
import re
from statistics import median
from types import SimpleNamespace

import cv2
from fuzzy_stereo_ros.pairs.image_files import read_image
from fuzzy_stereo_ros.pairs.messages import set_stamp
from fuzzy_stereo_ros.pairs.stereo_pair import BadPair, SIDES
from fuzzy_stereo_ros.pairs.synchroniser import Synchroniser

SECOND = 1_000_000_000
USUAL_RATE = 10.0           # frames per second, where neither names nor options say it
LOWEST_RATE, HIGHEST_RATE = 1e-3, 1e5
# Words for cameras, and such with a number; those of the left one come first in the alphabet.
CAMERAS = tuple(map(re.compile, (
    '(?i:left|right)|(?<![A-Z])[LR](?![A-Za-z])|(?<![A-Za-z])[lr](?![A-Za-z])',
    '(?<![A-Za-z])(?i:cam(?:era)?|infra(?:red)?|ir)[ _-]?[0-9](?![0-9])')))
NUMBER = re.compile('([0-9]+)')
ZEROS = re.compile(r'(?<![0-9.])0+(?=[0-9])')   # before a number, not behind a point
# A time since 1970, until 2033, or else in seconds; and its part behind a point, or counted.
TIMES = tuple(re.compile(rf'(?<!\d)({whole})(?:([._-])(\d{{1,15}}))?(?!\d)', re.ASCII)
              for whole in (r'1\d{9}(?:\d{3}){0,3}(?!\d)', r'\d{1,9}(?=\.\d{3})'))
UNITS = {10: SECOND, 13: 10**6, 16: 10**3, 19: 1}       # ns, by the digits of a time since 1970
SHORTEST_STEP = 10**6       # ns; names that count faster have no times
MOST_FRAMES = 10**8         # a larger number in a name is not that of a frame
MANY = 8                    # names that show that a number in all of them is that of the camera
IMAGE_SUFFIXES = '.png', '.jpg', '.jpeg', '.pgm', '.ppm', '.bmp', '.tif', '.tiff', '.webp'
VIDEOS = '.mp4', '.avi', '.mkv', '.mov', '.webm', '.m4v'
# Folders of the two cameras in the folder of a recording: ours, EuRoC's, KITTI's.
LAYOUTS = (('left', 'right'), ('cam0/data', 'cam1/data'), ('cam0', 'cam1'),
           ('image_0', 'image_1'), ('image_2', 'image_3'), ('colored_0', 'colored_1'),
           ('image_00/data', 'image_01/data'), ('image_02/data', 'image_03/data'),
           ('image_00', 'image_01'), ('image_02', 'image_03'))


class Frame:
    """An image that is read when it is needed, with a header as messages have it."""

    numbered = True     # its stamp may be 0, that of a message is then not set

    def __init__(self, stamp, source):
        """stamp: ns. source: the image, or its file (Path)."""
        self.header = SimpleNamespace(stamp=SimpleNamespace(), frame_id='left')
        set_stamp(self.header, stamp)
        self._source = source

    def read(self):
        """Return the image, as `read_image` does; BadPair if it cannot be read."""
        try:
            return read_image(self._source) if isinstance(self._source, Path) else self._source
        except ValueError as error:
            raise BadPair('damaged image', str(error)) from None


class Frames:
    """
    The frames of two cameras.

    name: of both, for a sentence. counts: {side: number of frames}. begin, end: ns, of the first
    and the last frame. stamped_by: where the stamps are from, in words.
    """

    def __init__(self, paths, rate=None):
        """
        Find the frames, and read no image.

        paths: the folder of a recording that has one of LAYOUTS, or images whose names tell both
        cameras; a video with both images side by side; or for each camera a folder, a pattern
        such as 'left/*.png', a file, or a video.
        rate: frames per second, which replaces the stamps of names and videos.
        Raises ValueError if there are none, or their names do not tell which belong together.
        """
        if rate is not None and not LOWEST_RATE <= rate <= HIGHEST_RATE:
            raise ValueError(
                f'--rate is {rate:g}; allowed are {LOWEST_RATE:g} to {HIGHEST_RATE:g}')
        self.paths, files = zip(*_sides_of(paths))
        self.name = ' and '.join(map(str, self.paths))
        self._stamped = None    # [(stamp, file)] of each side; None of videos
        if _is_video(self.paths[0]):
            videos = [_rate_and_count(path, rate) for path in self.paths]
            self._rates, counts = zip(*(videos * 2)[:2])
            self.begin, self.end = 0, max(stamp_at(count - 1, own) for own, count in videos)
            self.stamped_by = 'the rate of --rate' if rate else 'the rate of the video'
        else:
            stems = [[file.stem for file in side] for side in files]
            if any(len({*side}) < len(side) for side in stems):     # in several folders
                stems = [[str(file.with_suffix('')) for file in side] for side in files]
            if all(Path(path).is_file() for path in self.paths):
                stems[1] = stems[0]     # two images that are named one by one belong together
            stamps, self.stamped_by = stamps_of(self.name, stems, rate)
            self._stamped = [sorted(zip(*side)) for side in zip(stamps, files)]
            counts = map(len, files)
            self.begin, self.end = (choose(map(choose, stamps)) for choose in (min, max))
        self.counts = dict(zip(SIDES, counts))

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
        """Yield (stamp, left Frame, right Frame) of equal stamps; ValueError if there are none."""
        synchroniser = Synchroniser(SIDES)
        for frame in self.frames():
            for found in synchroniser.add(*frame):
                yield found.stamp, *found.messages
        if not synchroniser.matched:
            raise ValueError(f'{self.name}: no images have equal stamps; give their files equal '
                             'names')

    def _of_side(self, number):
        for stamp, source in self._stamped[number] if self._stamped else self._of_video(number):
            yield stamp, number, Frame(stamp, source)

    def _side_by_side(self):
        for stamp, image in self._of_video(0):
            half = image.shape[1] // 2
            for number in (0, 1):
                yield stamp, number, Frame(stamp, image[:, number * half:(number + 1) * half])

    def _of_video(self, number):
        """Yield (stamp, uint8 (R, C, 3) BGR) to the end of a video, whatever length it says."""
        video, place = cv2.VideoCapture(str(self.paths[number])), 0
        video.set(cv2.CAP_PROP_ORIENTATION_AUTO, 0)     # as of images
        while (found := video.read())[0]:
            yield stamp_at(place, self._rates[number]), found[1]
            place += 1


def _sides_of(paths):
    """Return [(path or pattern, its images)] of both cameras or one video; ValueError if none."""
    if len(paths) == 1 and Path(paths[0]).is_dir():
        there = _recordings_in(paths[0])
        if len(there) != 1:
            several = '; '.join(' and '.join(str(path) for path, _ in found) for found in there)
            raise ValueError(f'{paths[0]} holds several recordings, {several}; name the two '
                             'folders of one' if there else
                             f'{paths[0]} has no folders left and right, and no images that are '
                             'named by their camera (left_0.png and right_0.png); name two '
                             'folders')
        return there[0]
    if len(paths) > 2 or (len(paths) == 1 and not _is_video(paths[0])):
        raise ValueError(f'{len(paths)} images or folders are given; allowed are a recording, a '
                         "video, or two folders, videos or patterns in quotes: 'left/*.png' "
                         "'right/*.png'")
    if len({_is_video(path) for path in paths}) > 1:
        raise ValueError(f"{' and '.join(map(str, paths))}: one is a video, the other is not")
    sides = [(path, _listed(path)) for path in paths]
    for path, files in sides:
        if not files and not _is_video(path):
            raise ValueError(f"{path} has no images ({', '.join(IMAGE_SUFFIXES)})")
    return sides


def are_frames(paths):
    """Return whether paths name images or videos: those that are no bags."""
    return all(_is_video(path) or _is_pattern(path) or Path(path).suffix.lower() in IMAGE_SUFFIXES
               or (Path(path).is_dir() and bool(_listed(path) or _recordings_in(path)))
               for path in paths)


def are_pairs(paths):
    """Return whether paths are frames of two cameras."""
    return are_frames(paths) and (
        len(paths) > 1 or _is_video(paths[0]) or len(_recordings_in(paths[0])) == 1)


def _recordings_in(folder):
    """Return what `_sides_of` does, for each of LAYOUTS in a folder, or by names of images."""
    found = [[(path, _listed(path)) for path in (Path(folder) / side for side in layout)]
             for layout in LAYOUTS]
    found = [sides for sides in found if all(files for _, files in sides)]
    cameras = {}
    for file in [] if found else _listed(folder):
        cameras.setdefault(camera_and_frame(file.stem)[0], []).append(file)
    cameras.pop((), None)
    return [[(Path(folder) / '*'.join(('', *camera, '')), cameras[camera])
             for camera in sorted(cameras)]] if len(cameras) == 2 else found


def _is_video(path):
    return Path(path).suffix.lower() in VIDEOS


def _is_pattern(path):
    return any(sign in str(path) for sign in '*?[') and not Path(path).exists()


def _listed(path):
    found = Path(path).iterdir() if Path(path).is_dir() else map(Path, glob(str(path))) \
        if _is_pattern(path) else [Path(path)]
    return sorted(one for one in found if one.suffix.lower() in IMAGE_SUFFIXES
                  and not one.name.startswith('.') and one.is_file())   # ._: of macOS


def _rate_and_count(path, rate):
    """Return the frames per second of a video, which a rate replaces, and how many it has."""
    video = cv2.VideoCapture(str(path))
    count, own = (video.get(what) for what in (cv2.CAP_PROP_FRAME_COUNT, cv2.CAP_PROP_FPS))
    if not (video.isOpened() and video.grab()):
        raise ValueError(f'{path} is not a video that OpenCV can read')
    if not count >= 1:      # live recorders do not know it
        count = 1 + sum(1 for _ in iter(video.grab, False))
    return rate or own or USUAL_RATE, round(count)


def stamp_at(number, rate):
    """Return the stamp, ns, of a numbered frame at a rate, frames per second."""
    return round(number * SECOND / rate)


def camera_and_frame(stem):
    """Return the words for the camera in the name of a file, a tuple, and the rest."""
    camera = []
    for words in CAMERAS:
        found, rest = words.findall(stem), words.sub(' ', stem)
        if found and (found[0].isalpha() or NUMBER.search(rest)):   # else it numbers frames
            camera, stem = camera + found, rest
    return tuple(map(str.lower, camera)), stem


def stamps_of(name, stems, rate=None):
    """Return stamps, ns, of both cameras' names and their origin; rate: instead of times."""
    times = _times(stems)
    if times and rate is None:
        return times, 'the times in the names'
    for frames in ([[f'{time:019}' for time in side] for side in times or ()], *_readings(stems)):
        sides = [*map(set, frames)]
        if [*map(len, sides)] == [*map(len, stems)] and set.intersection(*sides):
            stamps = _stamps_in_order(set.union(*sides), rate or USUAL_RATE)
            origin = f'frame numbers at {rate or USUAL_RATE:g} per second'
            return ([[stamps[frame] for frame in side] for side in frames],
                    origin if rate else f'{origin} (see --rate)')
    raise ValueError(f'{name}: names as {stems[0][0]} and {stems[1][0]} do not tell which images '
                     'belong together; give those of a pair one name, number or time')


def _times(stems):
    """Return the times, ns, in the names of both cameras' files; None unless all are times."""
    frames = [camera_and_frame(stem)[1] for side in stems for stem in side]
    found = next(filter(all, ([[*time.findall(frame)][-1:] for frame in frames]
                              for time in TIMES)), None)
    if found is None:
        return None
    wholes, signs, parts = zip(*(one for one, in found))
    parts = [part if sign == '.' or len(whole) == 10 else ''
             for whole, sign, part in zip(wholes, signs, parts)]
    longest, width = max(map(len, parts)), 0
    if '.' not in signs or longest in (8, 9):       # nobody writes 8 decimals
        width = -(-longest // 3) * 3    # a count of ns, us or ms, perhaps without leading zeros
    usual = SECOND if longest < 10 else 10**6       # RealSense: ms with 14 decimals
    times = [int(whole) * unit + int(part.rjust(width, '0').ljust(18, '0')) * unit // 10**18
             for whole, part, unit in zip(wholes, parts, (
                 UNITS.get(len(whole), usual) for whole in wholes))]
    # What also has a number of a frame, or differs by less than a ns, is no time.
    if len({*times}) < len({*map(str, map(NUMBER.findall, frames))} if not any(parts) and {
            *map(len, wholes)} == {10} else {*zip(wholes, parts)}):
        return None
    times = times[:len(stems[0])], times[len(stems[0]):]
    for side in times:
        steps = [after - before for before, after in pairwise(sorted(side))]
        if steps and not (min(steps) > 0 and median(steps) > SHORTEST_STEP):
            return None
    return times


def _readings(stems):
    """Yield what the names of both cameras' files say of their frames, each time a bit less."""
    frames = [[camera_and_frame(stem)[1] for stem in side] for side in stems]
    for names in (stems, frames):
        yield [[ZEROS.sub('', name) for name in side] for side in names]
        yield names     # 1 and 01 may be two frames of a camera
    if any(len({NUMBER.sub('0', frame) for frame in side}) > 1 for side in frames):
        return
    numbers = [[[*map(int, NUMBER.findall(frame))] for frame in side] for side in frames]
    yield [[str(row) for row in side] for side in numbers]
    changing = [[*zip(*(column for column in zip(*side) if len({*column}) > 1))]
                for side in numbers]
    if len(stems[0]) >= MANY and sorted(changing[0]) == sorted(changing[1]):
        yield [[str(row) for row in side] for side in changing]


def _stamps_in_order(frames, rate):
    """Return {frame: stamp, ns}, by the one number that changes in names, or by place."""
    order = sorted(frames, key=lambda frame: [
        int(part) if place % 2 else part for place, part in enumerate(NUMBER.split(frame))])
    changing = [column for column in zip(*(map(int, NUMBER.findall(frame)) for frame in order))
                if len({*column}) > 1]
    if len(changing) != 1 or len({*changing[0]}) < len(order) or max(changing[0]) >= MOST_FRAMES:
        changing = [range(len(order))]
    return {frame: stamp_at(number, rate) for frame, number in zip(order, changing[0])}
