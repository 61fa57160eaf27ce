# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Pairs and sequences as the benchmarks score them: one percentage, and the frames that count."""
from dataclasses import dataclass

from bench.draws import with_draw
from fuzzy_stereo_ros.evaluation.baselines import ALGORITHMS, Baseline
from fuzzy_stereo_ros.evaluation.catalogue import Sequence
from fuzzy_stereo_ros.evaluation.ground_truth import agreeing, GroundTruthPair
from fuzzy_stereo_ros.evaluation.scores import score
from fuzzy_stereo_ros.matching.match import Camera
import numpy as np

DEFAULT = [Baseline(f'{name} default', name) for name in ALGORITHMS]
REFERENCE = Baseline('3WAY tuned', '3WAY', tuned=True)      # of benchmarks with one baseline
STRICTEST = Baseline('HH4 tuned, 0 rejected', 'HH4', tuned=True, rejects_zero=True)


@dataclass(frozen=True)
class ScoredPair(GroundTruthPair):
    """A `GroundTruthPair`; whole_pixel: its truth has whole pixels only, so maps are rounded."""

    whole_pixel: bool = False

    def as_scored(self, disparity):
        """Return a disparity map as it is scored: rounded if the truth has whole pixels."""
        return np.rint(disparity) if self.whole_pixel else disparity


@dataclass(frozen=True)
class ScoredSequence(Sequence):
    """
    A `Sequence`, read without noise; its group is its kind in the tables.

    noise: grey levels, standard deviation. alike: whether it is equal in the channels of a pixel.
    scored: numbers of the frames whose error counts, if they have a truth. pan: pixels per frame
    by which the window moves to the right. flickers: whether flicker is measured. camera: the
    `Camera` of a moving camera, None = not known.
    """

    noise: float = 0.0
    alike: bool = True
    scored: range = range(0)
    pan: int = 0
    flickers: bool = True
    camera: Camera | None = None

    @property
    def path(self):
        """Group and name, as progress shows them."""
        return ', '.join(filter(None, (self.group, self.name)))

    def drawn(self, draw):
        """Return a list of its frames with the noise of a draw."""
        return with_draw(self.read(), self.noise, draw, self.alike)


def bad_percent(disparity, pair, limit):
    """
    Return the percentage of scored pixels that are off by more than limit pixels, or invalid.

    disparity: float (R, C), pixels, NaN = invalid. pair: a `ScoredPair`.
    """
    return score(pair.as_scored(disparity), pair.truth, pair.counts, (limit,)).bad_dense[limit]


def cross_checked(truth_right, truth_left):
    """
    Return where the truths of both images agree within a pixel: bool (R, C), of the right image.

    truth_right, truth_left: float32 (R, C), pixels, NaN = unknown.
    """
    # Mirrored, the right image is a left one.
    return agreeing(truth_right[:, ::-1], truth_left[:, ::-1])[:, ::-1]
