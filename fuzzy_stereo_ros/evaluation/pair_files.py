# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The files of a pair with ground truth: which they are, and how they are read."""
from dataclasses import dataclass, field
from pathlib import Path
import re

from fuzzy_stereo_ros.evaluation.ground_truth import (
    KITTI, KnownPair, NUMBERS, read_mask, read_truth)
from fuzzy_stereo_ros.evaluation.visibility import agreeing, seen_by_both
from fuzzy_stereo_ros.matching import MatcherConfig
from fuzzy_stereo_ros.pairs.image_files import read_image, read_pair
from fuzzy_stereo_ros.pairs.stereo_pair import width_by_height
import numpy as np

PICTURES = ('.png', '.ppm', '.pgm', '.jpg', '.jpeg', '.bmp', '.tif', '.tiff')
MASKS = NONOCC, ALL, DISC = 'nonocc', 'all', 'disc'      # the one that counts most first
NONOCC_NAMES = NONOCC, 'nonocc_derived', 'visible'
NDISP = re.compile(r'^ndisp\s*=\s*(\d+)', re.MULTILINE)


class NoTruth(ValueError):
    """A pair that is there, but without anything that its disparities could be compared with."""


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
    whole_pixel: bool = False

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
        Return the `KnownPair`, with all masks that are known.

        Raises ValueError where a file cannot be read, or is of another size than the images.
        """
        left, right = read_pair(self.left, self.right)
        if self.truth is None:
            return KnownPair(left, right, None)

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
        return KnownPair(left, right, truth, masks.get(NONOCC), self.whole_pixel, masks)


def picture_of(folder, stem):
    """Return the picture of a folder with a name, whatever its format; None if it has none."""
    return first_of(folder, (stem + suffix for suffix in PICTURES))


def first_of(folder, names):
    """Return the path of the first of some names that a folder has, None if it has none."""
    return next((folder / name for name in names if (folder / name).is_file()), None)


def masks_of(folder, named=str):
    """Return {mask: path} of a folder; named(mask) is the name of its picture there."""
    found = {name: picture_of(folder, named(name)) for name in (ALL, DISC)}
    found[NONOCC] = next(filter(None, (picture_of(folder, named(name))
                                       for name in NONOCC_NAMES)), None)
    return {name: path for name, path in found.items() if path is not None}


def complete(layout, left, right, truth, wanted):
    """
    Return whether left image, right image and truth are there; False if not two of them are.

    left, right, truth: paths or None; wanted: the paths where they should be, to be named.
    Raises NoTruth where only the truth is missing, ValueError where one of the images is.
    """
    found = [left, right, truth]
    missing = [place for path, place in zip(found, wanted) if path is None]
    if len(missing) > 1:
        return False
    if truth is None:
        raise NoTruth(f'{wanted[0].parent} has images but no ground truth: there is no '
                      f'{wanted[2].name}')
    if missing:
        raise ValueError(f'{missing[0]} is missing; {layout} has '
                         f'{", ".join(path.name for path in wanted)}')
    return True


def told_disparities(folder):
    """
    Return (disparities, where it says so) of a folder with a calib.txt, else (None, '').

    Raises ValueError where they are so few or many that nothing can be searched.
    """
    calibration = folder / 'calib.txt'
    if calibration.is_file():
        found = NDISP.search(calibration.read_text(encoding='utf-8', errors='replace'))
        if found:
            try:
                return MatcherConfig(disparities=int(found[1])).disparities, 'calib.txt'
            except ValueError as error:
                raise ValueError(f'{calibration} has {found[0]}: {error}; leave the line '
                                 'out, or the scene') from None
    return None, ''
