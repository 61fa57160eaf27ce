# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Disparities that another program wrote, as a contestant: a file for each scene or frame."""
from pathlib import Path

from fuzzy_stereo_ros.evaluation.baselines import dense
from fuzzy_stereo_ros.evaluation.matchers import Maps
from fuzzy_stereo_ros.pairs.disparity_files import read_disparity
from fuzzy_stereo_ros.pairs.image_files import read_image
from fuzzy_stereo_ros.pairs.stereo_pair import width_by_height
import numpy as np

SUFFIXES = ('.pfm', '.npy', '.npz', '.png')     # the first of a name counts


class Results:
    """
    The files of a folder that are named like scenes: FOLDER/scene.pfm or FOLDER/scene/any.pfm.

    A scene may leave out the folders in its name where no other ends like it.
    """

    starts = ('',)

    def __init__(self, name, folder, scenes):
        """
        Look for the files of some scenes, given by their names.

        Raises ValueError where there is no folder, or nothing of any scene in it.
        """
        self.name, self.folder = name, Path(folder)
        if not self.folder.is_dir():
            raise ValueError(f'--results names {folder}, but there is no such folder')
        ends = [scene.split('/')[-1] for scene in scenes]
        self._files = {
            scene: self._file_of(scene) or (self._file_of(end) if ends.count(end) == 1 else None)
            for scene, end in zip(scenes, ends)}
        if not any(self._files.values()):
            raise ValueError(f'{folder} has no result of any scene; the one of {scenes[0]} would '
                             f'be {self.folder / ends[0]}.pfm, .npy or .png')

    @property
    def missing(self):
        """The names of the scenes without a result."""
        return [scene for scene, path in self._files.items() if path is None]

    def player(self, task, start):
        """Return what reads the result of a frame; None where there is none."""
        def play(name, known):
            found = self.read(name, known.left)
            if found is None:
                return None
            return Maps(found, found if np.isfinite(found).all() else dense(found), None)
        return play

    def read(self, scene, image):
        """
        Return the disparities of a scene, float32 (R, C), px, NaN = invalid; None without a file.

        image: (R, C, ...), of the scene. Raises ValueError where a file cannot be read or is of
        another size.
        """
        path = self._files.get(scene)
        if path is None:
            return None
        if path.suffix == '.png' and read_image(path).dtype != np.uint16:
            raise ValueError(f'{path} has 8 bits; results are .pfm, .npy, .npz, or .png of 16 '
                             'bits, 256 times the disparity')
        found = read_disparity(path)
        if found.shape != image.shape[:2]:
            raise ValueError(f'{path} is {width_by_height(found)}, the images of {scene} are '
                             f'{width_by_height(image)}')
        return found

    def _file_of(self, name):
        for suffix in SUFFIXES:
            path = self.folder / (name + suffix)
            if path.is_file():
                return path
        inside = self.folder / name
        for suffix in SUFFIXES:
            files = sorted(inside.glob(f'*{suffix}')) if inside.is_dir() else []
            if len(files) > 1:
                raise ValueError(f'{inside} has {len(files)} files that end with {suffix}; '
                                 'one is allowed')
            if files:
                return files[0]
        return None
