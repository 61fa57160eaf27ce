# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The matchers under test: ours with its profiles, OpenCV's, and result files of other programs.

A matcher has a name; starts, the ways to run through a sequence: COLD, WARM, or '' if frames are
independent; and begin(task, start). This returns a function match(name, pair) of the name of a
frame and its `GroundTruthPair`, which returns `Maps`, or None if the matcher has no result, and
raises ValueError for a frame that cannot be matched.
"""
from dataclasses import dataclass, field
import glob
from pathlib import Path
import time
from typing import NamedTuple

import cv2
from fuzzy_stereo_ros.evaluation.baselines import ALGORITHMS, Baseline, dense
from fuzzy_stereo_ros.matching import MatcherConfig, PROFILES, StereoMatcher
from fuzzy_stereo_ros.matching.plausibility import Finding, PlausibilityCheck
from fuzzy_stereo_ros.matching.row_offsets import Misalignment
from fuzzy_stereo_ros.pairs.disparity_files import read_disparity
from fuzzy_stereo_ros.pairs.image_files import read_image
from fuzzy_stereo_ros.pairs.stereo_pair import width_by_height
import numpy as np

COLD, WARM = 'cold', 'warm'
OURS, OPENCV, TUNED = 'ours', 'opencv', 'tuned'
USUAL = OURS, *(f'{OPENCV}:{name.lower()}:{TUNED}' for name in ALGORITHMS)
ALLOWED = (OURS, *(f'{OURS}:{name}' for name in PROFILES),
           *(f'{OPENCV}:{name.lower()}{end}' for name in ALGORITHMS for end in ('', f':{TUNED}')))
RESULT_SUFFIXES = ('.pfm', '.npy', '.npz', '.png')     # the first existing one counts


class Task(NamedTuple):
    """The task of a matcher."""

    family: str  # MIDDLEBURY or KITTI, for tuned settings
    disparities: int  # number to search from 0
    size: tuple  # rows and columns
    repeats: int  # runs on each frame, of which the fastest counts


class Maps(NamedTuple):
    """The result of a matcher on a frame; None = the matcher does not know it."""

    raw: np.ndarray  # float32 (R, C), px, NaN = invalid
    filled: np.ndarray  # the same without gaps
    milliseconds: float | None  # of ours from images to raw, of OpenCV's `compute` alone
    confidence: np.ndarray | None = None  # float32 (R, C), 0 to 1, of raw
    misalignment: Misalignment | None = None  # of the rows so far
    finding: Finding | None = None  # why little is matched


@dataclass(frozen=True)
class Ours:
    """Our matcher: a profile, changed parameters, replaced stages; maps of the left image."""

    name: str
    profile: str = 'realtime'
    changes: dict = field(default_factory=dict)
    stages: object = None

    def config(self, disparities, **forced):
        """Return the `MatcherConfig`; forced: {parameter: value}, which override all others."""
        return MatcherConfig.from_profile(self.profile, **{
            'fill': True, 'threads': 1, **self.changes, 'reference': 'left',
            'disparities': disparities, **forced})

    def matcher(self, disparities, **forced):
        return StereoMatcher(self.config(disparities, **forced), self.stages)

    @property
    def description(self):
        """The profile and the changed parameters in words."""
        changes = ', '.join(f'{name} = {value}' for name, value in sorted(self.changes.items())
                            if name != 'threads')
        return f'profile {self.profile}' + (f' with {changes}' if changes else '')

    @property
    def starts(self):
        """Cold, and for profiles that use the previous frame warm too."""
        return (COLD, WARM) if self.config(1).warm_start else (COLD,)

    def begin(self, task, start):
        """Return the function that matches a frame, cold or from the previous one."""
        raw, filling = (self.matcher(task.disparities, warm_start=start == WARM, fill=fill)
                        for fill in (False, True))
        raw.warm_up(*task.size)

        def match(_, pair):
            before = raw.state

            def again():
                raw.restore(before, raw.rows)
                return raw.match(pair.left, pair.right)

            found, milliseconds = fastest(again, task.repeats)
            return Maps(found.disparity, filling.match(pair.left, pair.right).disparity,
                        milliseconds, found.confidence, found.misalignment,
                        PlausibilityCheck().add(pair.left, pair.right, found, raw.config))
        return match


@dataclass(frozen=True)
class OpenCV(Baseline):
    """One of OpenCV's matchers, on grey images of 8 bits; frames are independent."""

    starts = ('',)

    def begin(self, task, start):
        """Return the function that matches a frame; timed is OpenCV's own work alone."""
        matcher = self.matcher(task.family, task.disparities)

        def match(_, pair):
            images = matcher.images(pair.left, pair.right)
            try:
                found, milliseconds = fastest(
                    lambda: matcher.opencv.compute(*images), task.repeats)
            except cv2.error as error:
                raise ValueError(
                    f'OpenCV cannot match {width_by_height(pair.left)} pixels with '
                    f'{task.disparities} disparities: {" ".join(error.err.split())}') from None
            found = matcher.disparity(found)
            return Maps(found, dense(found), milliseconds)
        return match


class ResultFiles:
    """
    Disparity files of another program, named like scenes: FOLDER/scene.pfm, FOLDER/scene/*.

    Folders in the name of a scene may be left out if its last part is unique.
    """

    starts = ('',)

    def __init__(self, name, folder, scenes):
        """Find the files of scenes, by their names; ValueError without the folder or any file."""
        self.name, self.folder = name, Path(folder)
        if not self.folder.is_dir():
            raise ValueError(f'--results names {folder}, but there is no such folder')
        ends = [scene.split('/')[-1] for scene in scenes]
        self.files = {
            scene: self._file_of(scene) or (self._file_of(end) if ends.count(end) == 1 else None)
            for scene, end in zip(scenes, ends)}
        if not any(self.files.values()):
            raise ValueError(f'{folder} has no result of any scene; name the one of {scenes[0]} '
                             f'{self.folder / ends[0]}.pfm, .npy or .png')

    def begin(self, task, start):
        """Return the function that reads the result of a frame; None if it has none."""
        def match(name, pair):
            found = self.read(name, pair.left)
            if found is None:
                return None
            return Maps(found, found if np.isfinite(found).all() else dense(found), None)
        return match

    def read(self, scene, image):
        """Return disparities, float32 (R, C), None without a file; ValueError if damaged."""
        path = self.files.get(scene)
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
        """Return the path of the result file of a name, None if there is none."""
        for end in ('', '/*'):
            for suffix in RESULT_SUFFIXES:
                files = sorted(filter(Path.is_file, self.folder.glob(
                    glob.escape(name) + end + suffix)))
                if len(files) > 1:
                    raise ValueError(f'{self.folder / name} has {len(files)} files that end with '
                                     f'{suffix}; one is allowed')
                if files:
                    return files[0]
        return None


def matcher_named(word, profile, changes):
    """Return the matcher of a word; profile, changes: of `Ours`. ValueError if not allowed."""
    if word not in ALLOWED:
        raise ValueError(f"matcher is '{word}'; allowed are {', '.join(ALLOWED)}")
    kind, *rest = word.split(':')
    if kind == OPENCV:
        return OpenCV(word, rest[0].upper(), tuned=rest[1:] == [TUNED])
    made = Ours(word, rest[0] if rest else profile, changes)
    made.config(1)
    return made


def fastest(work, repeats, processor=False):
    """
    Return the result of the last call of work(), and the milliseconds of the fastest one.

    repeats: calls, 1 or more; processor: whether time of the processors counts, not of the clock
    """
    times, clock = [], time.process_time_ns if processor else time.perf_counter_ns
    for _ in range(repeats):
        started = clock()
        found = work()
        times.append((clock() - started) / 1e6)
    return found, min(times)
