# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a search for scenes finds: single pairs, and sequences of frames."""
from dataclasses import dataclass, replace
import os
from pathlib import Path

from fuzzy_stereo_ros.evaluation.ground_truth import KITTI, LIMITS, MIDDLEBURY
from fuzzy_stereo_ros.evaluation.pair_files import PairFiles


@dataclass(frozen=True)
class Found:
    """
    What scenes and sequences have in common.

    place: its folder; where a folder holds many, with the name of this one added.
    layout: how its folder is laid out. disparities: to search, from 0, as told_by says, which
    is '' where nothing tells. name: of the scene in tables and in folders of results.
    """

    place: Path
    layout: str
    disparities: int | None = None
    told_by: str = ''
    name: str = ''

    @property
    def path(self):
        """The name, as progress shows it."""
        return self.name

    @property
    def limit(self):
        """Errors above so many pixels are bad."""
        return LIMITS[self.family]


@dataclass(frozen=True)
class FoundScene(Found):
    """One pair with a truth; files: its `PairFiles`."""

    files: PairFiles = None

    @property
    def family(self):
        """Whose settings the rivals take."""
        return self.files.family


@dataclass(frozen=True)
class FoundSequence(Found):
    """Frames in their order; frames: {number as it is written: `PairFiles`}."""

    frames: dict = None

    @property
    def family(self):
        """Whose settings the rivals take."""
        kitti = any(files.family == KITTI for files in self.frames.values())
        return KITTI if kitti else MIDDLEBURY


def with_names(found):
    """
    Return what was found, each named by its place below the deepest folder that holds all.

    found: list of `Found`; two of one place stay one scene and one sequence of one name.
    """
    if not found:
        return []
    places = [Path(os.path.abspath(each.place)) for each in found]
    above = os.path.commonpath([place.parent for place in places])
    return [replace(each, name=place.relative_to(above).as_posix())
            for each, place in zip(found, places)]
