# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a scene and a sequence are, and how the files of a pair with ground truth are read."""
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
import re

from fuzzy_stereo_ros.evaluation.ground_truth import (
    agreeing, ALL, GroundTruthPair, KITTI, LIMITS, MASKS, NONOCC, NUMBERS, read_mask, read_truth,
    seen_by_both)
from fuzzy_stereo_ros.matching.match import Camera
from fuzzy_stereo_ros.pairs.image_files import read_image, read_pair
from fuzzy_stereo_ros.pairs.stereo_pair import width_by_height
import numpy as np

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
WHOLE_PIXEL_TRUTH = {'tsukuba'}
OF_2001 = {'barn1', 'barn2', 'bull', 'poster', 'sawtooth', 'venus'}     # 8 grey levels a pixel
LEVELS_OF_2003 = {450: 4, 900: 2, 1800: 1}      # {columns: grey levels} of teddy and cones
LEVELS_OF_2005 = {370: 3, 555: 2, 1110: 1}      # {rows: grey levels} of the sets of 2005, 2006
BY_NAME = 'the name of the scene'


@dataclass(frozen=True)
class Scene:
    """
    A pair with ground truth; `read()` returns its `GroundTruthPair`.

    group: of the benchmarks, '' for others. family: whose tuned settings the baselines take.
    disparities: searched from 0, None where nothing says it; told_by: who says it.
    files: its `PairFiles`, None for a synthetic scene.
    """

    group: str
    name: str
    family: str
    disparities: int | None
    read: Callable
    told_by: str = ''
    layout: str = ''
    files: object = field(default=None, hash=False)

    @property
    def limit(self):
        """Errors above so many pixels are bad."""
        return LIMITS[self.family]

    @property
    def path(self):
        """Group and name, as they are written in tables."""
        return f'{self.group}/{self.name}' if self.group else self.name

    @property
    def named_files(self):
        """The `PairFiles` of its one frame, as {name: files}."""
        return {self.path: self.files}


@dataclass(frozen=True)
class Sequence:
    """
    Frames in their order; `read()` returns an iterable of their `GroundTruthPair`s.

    kind: sequences of one kind share a line of a table of the benchmarks; '' for others.
    scored: numbers of the frames whose error counts, those without truth left out. pan: pixels
    per frame that the window moves to the right. flickers: whether changes between frames tell
    anything. frames: {number as it is written: `PairFiles`}, empty for those of the benchmarks.
    camera: the `Camera`, where it moves in space; None where it is not known.
    """

    kind: str
    name: str
    family: str
    disparities: int | None
    read: Callable
    scored: range = range(0)
    pan: int = 0
    flickers: bool = True
    told_by: str = ''
    layout: str = ''
    frames: dict = field(default_factory=dict, hash=False)
    camera: Camera | None = None

    limit = Scene.limit

    @property
    def path(self):
        """Kind and name, as progress shows them."""
        return f'{self.kind}, {self.name}' if self.kind else self.name

    @property
    def named_files(self):
        """The `PairFiles` of its frames, as {name of the sequence and number: files}."""
        return {f'{self.path}/{number}': files for number, files in self.frames.items()}


@dataclass(frozen=True)
class PairFiles:
    """
    Where the files of a pair are.

    family: KITTI's truth has gaps everywhere, so that nothing about hidden pixels follows from it.
    truth: of the left image, None = there is none. scale: see `read_truth`.
    visible_truth: the truth of the pixels that both cameras see. right_truth: of the right image.
    masks: {name: path} of pictures in which 255 counts.
    """

    left: Path
    right: Path
    family: str
    truth: Path | None = None
    scale: float | None = None
    visible_truth: Path | None = None
    right_truth: Path | None = None
    masks: dict = field(default_factory=dict)

    @property
    def whole_pixel(self):
        """Whether the truth has whole pixels only."""
        return self.left.resolve().parent.name.lower() in WHOLE_PIXEL_TRUTH

    @property
    def derives_visibility(self):
        """Whether the pixels that both cameras see are found from the truth itself."""
        return (self.truth is not None and self.family != KITTI and NONOCC not in self.masks
                and self.visible_truth is None)

    def check_scale(self):
        """Raise ValueError where the truth is in grey levels whose scale is not known."""
        grey = self.truth.suffix.lower() not in NUMBERS
        if (grey and self.family != KITTI and self.scale is None
                and read_image(self.truth).dtype == np.uint8):
            raise ValueError(f'{self.truth} has 8 bits: say with --truth-scale how many grey '
                             'levels one pixel of disparity is')

    def read(self):
        """
        Return the `GroundTruthPair`, with all masks that are known.

        Raises ValueError where a file cannot be read, or is of another size than the images.
        """
        left, right = read_pair(self.left, self.right)
        if self.truth is None:
            return GroundTruthPair(left, right, None)

        def checked(array, path):
            if array.shape != left.shape[:2]:
                raise ValueError(f'{path} is {width_by_height(array)}, the images are '
                                 f'{width_by_height(left)}')
            return array

        def truth_of(path):
            return checked(read_truth(path, self.scale), path)

        truth = truth_of(self.truth)
        masks = {name: checked(read_mask(path), path) for name, path in self.masks.items()}
        if self.truth != self.visible_truth:
            masks.setdefault(ALL, np.isfinite(truth))
        if self.visible_truth is not None:
            masks[NONOCC] = np.isfinite(truth_of(self.visible_truth))
        elif self.derives_visibility:
            masks[NONOCC] = (seen_by_both(truth) if self.right_truth is None
                             else agreeing(truth, truth_of(self.right_truth)))
        masks = {name: masks[name] for name in MASKS if name in masks}
        return GroundTruthPair(left, right, truth, masks.get(NONOCC), self.whole_pixel, masks)


def scale_of(folder, left, given=None):
    """
    Return (levels, disparities, told_by) of a folder: what its grey levels and its name tell.

    levels: grey levels per pixel of disparity, given where nothing tells it, None = not known.
    disparities: to search, None = not known; told_by: who says so. left: path of the left image,
    whose size tells the scale of some.
    """
    stated = folder / 'info.txt'
    numbers = re.fullmatch(r'\s*(\d+)\s+(\d+)\s*', stated.read_text(
        encoding='utf-8', errors='replace')) if stated.is_file() else None
    if numbers:     # grey levels, largest disparity
        return int(numbers[1]), int(numbers[2]) + 1, 'info.txt'
    group, name = ('', '', *folder.resolve().parts)[-2:]
    if name in MIDDLEBURY_FOLDERS.get(group, ()):
        return *MIDDLEBURY_FOLDERS[group][name], BY_NAME
    name = name.lower()
    if name in ('teddy', 'cones'):
        levels = LEVELS_OF_2003.get(read_image(left).shape[1])
        return (levels, 240 // levels, BY_NAME) if levels else (given, None, '')
    for known in (MIDDLEBURY_FOLDERS['middv2'], MIDDLEBURY_FOLDERS['midd2001']):
        if name in known:
            return *known[name], BY_NAME
    if left.stem == 'view1':
        given = LEVELS_OF_2005.get(read_image(left).shape[0], given)
    return 8 if name in OF_2001 else given, None, ''
