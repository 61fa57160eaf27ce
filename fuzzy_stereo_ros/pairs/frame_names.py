# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Read the names of image files: which camera took the image, which frame it is of, and when.

Images of two cameras are a pair where their names say the same, apart from what names the camera.
Names are read as far as one that shows equal frames: the times in them; the names; the names
without the words for the camera; the numbers in them; and those that change. Zeros before numbers
say nothing. Names that never show equal frames make no pair.
"""
from itertools import pairwise
import re
from statistics import median

SECOND = 1_000_000_000
USUAL_RATE = 10.0           # frames per second, where neither names nor options say it
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
    """
    Return the stamps, ns, of both cameras' files, and their origin in words.

    name: of both, for a sentence. stems: two lists of names without suffixes. rate: frames per
    second, which replaces the times in names.
    Raises ValueError where the names do not tell which files belong together.
    """
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
