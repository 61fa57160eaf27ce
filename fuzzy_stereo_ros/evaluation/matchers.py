# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Who is compared: our matcher with its profiles, OpenCV's, and files that others wrote.

A contestant has a name; starts, of which each plays a sequence of its own ('' where a frame never
depends on the one before); and player(task, start), which returns what is called with the name of
each frame and its `KnownPair` in turn, and returns `Maps`, or None where it has nothing; it
raises ValueError for a frame that cannot be matched.
"""
from dataclasses import dataclass
import time
from typing import NamedTuple

import cv2
from fuzzy_stereo_ros.evaluation.baselines import ALGORITHMS, default_rivals, dense, tuned_rivals
from fuzzy_stereo_ros.matching import MatcherConfig, PROFILES, StereoMatcher
from fuzzy_stereo_ros.pairs.stereo_pair import width_by_height
import numpy as np

COLD, WARM = 'cold', 'warm'
OURS, OPENCV, TUNED = 'ours', 'opencv', 'tuned'
USUAL = OURS, *(f'{OPENCV}:{name.lower()}:{TUNED}' for name in ALGORITHMS)
ALLOWED = (OURS, *(f'{OURS}:{name}' for name in PROFILES),
           *(f'{OPENCV}:{name.lower()}{end}' for name in ALGORITHMS for end in ('', f':{TUNED}')))


class Task(NamedTuple):
    """
    What a player is asked for.

    family: whose settings it takes. disparities: to search, from 0. size: rows and columns.
    repeats: how often each frame is matched, to take the time.
    """

    family: str
    disparities: int
    size: tuple
    repeats: int


class Maps(NamedTuple):
    """
    What a contestant says about a frame.

    found: float32 (R, C), pixels, NaN = invalid. filled: the same without gaps.
    milliseconds: the fastest, from images to found; None = not known.
    """

    found: np.ndarray
    filled: np.ndarray
    milliseconds: float | None


@dataclass(frozen=True)
class Ours:
    """Our matcher, from the left image; it fills by itself. changes: {parameter: value}."""

    name: str
    profile: str
    changes: dict

    def config(self, disparities, **forced):
        """Return the configuration, which belongs to the left image as truths do."""
        return MatcherConfig.from_profile(
            self.profile, **{**self.changes, 'reference': 'left', 'disparities': disparities,
                             **forced})

    @property
    def starts(self):
        """Cold, and warm where the search leaves something for the next frame."""
        return (COLD, WARM) if self.config(1).algorithm == 'realtime' else (COLD,)

    def player(self, task, start):
        """Return what matches frames, each by itself, or warm from the one before."""
        warm = start == WARM
        matcher, filler = (StereoMatcher(self.config(task.disparities, warm_start=warm, fill=fill))
                           for fill in (False, True))
        matcher.warm_up(*task.size)

        def play(_, known):
            before = matcher.state

            def match():
                matcher.restore(before)
                return matcher.match(known.left, known.right).disparity

            found, milliseconds = _fastest(match, task.repeats)
            return Maps(found, filler.match(known.left, known.right).disparity, milliseconds)
        return play


@dataclass(frozen=True)
class OpenCV:
    """One of OpenCV's matchers, at the defaults of stereo_image_proc or tuned for a family."""

    name: str
    algorithm: str
    tuned: bool
    starts = ('',)

    def rival(self, family):
        """Return the `Rival`; None where it was not tuned for the family."""
        rivals = tuned_rivals(family) if self.tuned else default_rivals()
        return next((rival for rival in rivals if rival.algorithm == self.algorithm), None)

    def player(self, task, start):
        """Return what matches frames; a frame depends on no other."""
        rival = self.rival(task.family)
        if rival is None:
            return lambda name, known: None

        def play(_, known):
            pair = in_eight_bits_alike(known.left, known.right)
            try:
                found, milliseconds = _fastest(lambda: rival.match(*pair, task.disparities),
                                               task.repeats)
            except cv2.error as error:
                raise ValueError(
                    f'OpenCV cannot match {width_by_height(pair[0])} pixels with '
                    f'{task.disparities} disparities: {" ".join(error.err.split())}') from None
            return Maps(found, dense(found), milliseconds)
        return play


def contestant_of(word, profile, changes):
    """
    Return the contestant that a word names; profile and changes are those of our matcher.

    Raises ValueError for another word, and where a change is not allowed.
    """
    if word not in ALLOWED:
        raise ValueError(f"matcher is '{word}'; allowed are {', '.join(ALLOWED)}")
    kind, *rest = word.split(':')
    if kind == OPENCV:
        return OpenCV(word, rest[0].upper(), rest[1:] == [TUNED])
    made = Ours(word, rest[0] if rest else profile, changes)
    made.config(1)
    return made


def in_eight_bits_alike(left, right):
    """Return both images as uint8, as OpenCV's matchers want them; 16 bits by one factor."""
    if left.dtype == right.dtype == np.uint8:
        return left, right
    top = max(int(left.max()), int(right.max()), 1)
    return tuple(np.rint(image * (255 / top)).astype(np.uint8) for image in (left, right))


def _fastest(work, repeats):
    """Return what a function returns, and the milliseconds of the fastest of some calls."""
    times = []
    for _ in range(repeats):
        started = time.perf_counter_ns()
        found = work()
        times.append((time.perf_counter_ns() - started) / 1e6)
    return found, min(times)
