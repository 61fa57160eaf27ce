# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Pairs with ground truth: their files, their masks, and the pixels that both cameras see."""
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from fuzzy_stereo_ros.pairs.disparity_files import read_disparity
from fuzzy_stereo_ros.pairs.image_files import read_image, read_pair
from fuzzy_stereo_ros.pairs.stereo_pair import width_by_height
import numpy as np

MIDDLEBURY, KITTI = 'Middlebury', 'KITTI'
LIMITS = {MIDDLEBURY: 1.0, KITTI: 3.0}      # px; an error above the limit of its family is bad
NUMBERS = ('.pfm', '.npy', '.npz')          # suffixes of files in pixels, not grey levels
MASKS = NONOCC, ALL, DISC = 'nonocc', 'all', 'disc'      # the most important one first
TOLERANCE = 1.0     # px between the truths of a pixel and of its match in the other image


@dataclass(frozen=True)
class GroundTruthPair:
    """A stereo pair with ground truth."""

    left: np.ndarray  # uint8 or uint16 (R, C) or (R, C, 3) BGR
    right: np.ndarray
    truth: np.ndarray | None  # float32 (R, C), px, NaN = unknown; None = no truth
    counts: np.ndarray | None = None  # bool (R, C), to be scored; None = all with a truth
    masks: dict = field(default_factory=dict)  # {name of MASKS, in this order: bool (R, C)}


@dataclass(frozen=True)
class PairFiles:
    """The paths of the files of a pair."""

    left: Path
    right: Path
    family: str  # MIDDLEBURY, or KITTI, too sparse to derive occlusion from
    truth: Path | None = None  # of the left image
    scale: float | None = None  # see `read_truth`
    visible_truth: Path | None = None  # of the pixels that both cameras see
    right_truth: Path | None = None
    masks: dict = field(default_factory=dict)  # {name: path of a picture where 255 counts}

    @property
    def derives_visibility(self):
        """Whether the mask of pixels that both cameras see is derived from the truth."""
        return (self.truth is not None and self.family != KITTI and NONOCC not in self.masks
                and self.visible_truth is None)

    def check_scale(self):
        """Raise ValueError if the truth is in grey levels of unknown scale."""
        grey = self.truth.suffix.lower() not in NUMBERS
        if (grey and self.family != KITTI and self.scale is None
                and read_image(self.truth).dtype == np.uint8):
            raise ValueError(f'{self.truth} has 8 bits and no known scale: give --truth-scale, '
                             'the grey levels per pixel of disparity')

    def read(self):
        """Return the `GroundTruthPair` with all masks; ValueError for a bad file or size."""
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
        return GroundTruthPair(left, right, truth, masks.get(NONOCC), masks=masks)


class PairWithoutTruth(NamedTuple):
    """A pair without ground truth; read(): returns it, as that of `PairFiles`."""

    read: Callable
    truth, derives_visibility = None, False


def read_truth(path, scale=None):
    """Return disparities as `read_disparity`; scale: ignored for files that are no pictures."""
    return read_disparity(path, None if Path(path).suffix.lower() in NUMBERS else scale)


def read_mask(path):
    """Return where a picture is 255: bool (R, C)."""
    levels = read_image(path)
    return (levels if levels.ndim == 2 else levels[:, :, 0]) == 255


def warped_to_right(truth):
    """Return a truth, float32 (R, C), px, warped to the right image, NaN where nothing is."""
    rows, target, inside = _targets(truth)
    warped = np.full(truth.shape, -np.inf, np.float32)
    np.maximum.at(warped, (rows[inside], target[inside]), truth[inside])
    return np.where(np.isfinite(warped), warped, np.nan).astype(np.float32)


def seen_by_both(truth):
    """Return which left pixels both cameras see, hidden by nothing nearer: bool (R, C)."""
    rows, target, inside = _targets(truth)
    nearest = warped_to_right(truth)
    seen = inside.copy()
    seen[inside] = truth[inside] >= nearest[rows[inside], target[inside]] - TOLERANCE
    return seen


def agreeing(truth, other):
    """Return where a truth agrees with that of the right image within a pixel: bool (R, C)."""
    return abs(truth - at_matches(truth, other)) <= TOLERANCE


def at_matches(disparity, other):
    """Return the right image's values at the left pixels' matches: float (R, C), NaN = none."""
    rows, target, inside = _targets(disparity)
    return np.where(inside, other[rows, target], np.float32(np.nan))


def _targets(truth):
    """Return the row and the matching right column of each pixel, and whether it is inside."""
    rows, columns = np.indices(truth.shape)
    target = columns - truth
    inside = np.isfinite(target) & (target >= 0) & (target <= truth.shape[1] - 1)
    return rows, np.rint(np.where(inside, target, 0)).astype(np.intp), inside
