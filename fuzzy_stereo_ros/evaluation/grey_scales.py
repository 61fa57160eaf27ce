# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
What Middlebury's grey pictures of disparities mean.

Their folders seldom tell the grey levels per pixel of disparity: it is known by the name of the
scene, by the size of the images, or must be said.
"""
import re
from typing import NamedTuple

from fuzzy_stereo_ros.pairs.image_files import read_image

# group: {scene: (grey levels per pixel of disparity, disparities)}
MIDDLEBURY_FOLDERS = {
    'middv2': {'tsukuba': (16, 16), 'venus': (8, 20), 'teddy': (4, 60), 'cones': (4, 60)},
    'midd2001': {'bull': (8, 21), 'sawtooth': (8, 19)},
    'midd2006_third': {
        'Aloe': (3, 72), 'Baby1': (3, 47), 'Bowling1': (3, 78), 'Cloth1': (3, 59),
        'Cloth3': (3, 57), 'Flowerpots': (3, 62), 'Lampshade1': (3, 66), 'Midd1': (3, 70),
        'Rocks1': (3, 58), 'Wood1': (3, 73)},
    'midd2006_half': {'Cloth3': (2, 84)},
}
OF_2001 = {'barn1', 'barn2', 'bull', 'poster', 'sawtooth', 'venus'}     # 8 grey levels a pixel
LEVELS_OF_2003 = {450: 4, 900: 2, 1800: 1}      # {columns: grey levels} of teddy and cones
LEVELS_OF_2005 = {370: 3, 555: 2, 1110: 1}      # {rows: grey levels} of the sets of 2005, 2006
BY_NAME = 'the name of the scene'


class Scale(NamedTuple):
    """
    What the grey levels of a folder's truth mean.

    levels: per pixel of disparity; None = not known. disparities: to search, None = not known;
    told_by: who says so.
    """

    levels: float | None
    disparities: int | None = None
    told_by: str = ''


def scale_of(folder, left, given=None):
    """
    Return the `Scale` of a folder of Middlebury's; given, a number, stands in for an unknown one.

    left: path of the left image, whose size tells the scale of some.
    """
    stated = folder / 'info.txt'
    numbers = re.fullmatch(r'\s*(\d+)\s+(\d+)\s*', stated.read_text(
        encoding='utf-8', errors='replace')) if stated.is_file() else None
    if numbers:     # grey levels, largest disparity
        return Scale(int(numbers[1]), int(numbers[2]) + 1, 'info.txt')
    group, name = folder.resolve().parts[-2:] if len(folder.resolve().parts) > 1 else ('', '')
    if name in MIDDLEBURY_FOLDERS.get(group, ()):
        return Scale(*MIDDLEBURY_FOLDERS[group][name], BY_NAME)
    name = name.lower()
    rows, columns = read_image(left).shape[:2]
    if name in ('teddy', 'cones') and columns in LEVELS_OF_2003:
        levels = LEVELS_OF_2003[columns]
        return Scale(levels, 240 // levels, BY_NAME)
    for known in (MIDDLEBURY_FOLDERS['middv2'], MIDDLEBURY_FOLDERS['midd2001']):
        if name in known and name not in ('teddy', 'cones'):
            return Scale(*known[name], BY_NAME)
    if name in OF_2001:
        return Scale(8)
    if left.stem == 'view1' and rows in LEVELS_OF_2005:
        return Scale(LEVELS_OF_2005[rows])
    return Scale(given)
