# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Small made scenes, noise, matches of them, and how matches compare."""
from dataclasses import replace
from functools import cache, partial

from bench.scoring import ScoredPair
import cv2
from fuzzy_stereo_ros.evaluation.catalogue import Scene
from fuzzy_stereo_ros.evaluation.ground_truth import MIDDLEBURY
from fuzzy_stereo_ros.evaluation.scores import score
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.matching.match import Camera, Match
from fuzzy_stereo_ros.matching.row_alignment import Rows
from fuzzy_stereo_ros.pair_matcher import MatchedPair
from fuzzy_stereo_ros.pairs.stereo_pair import Calibration, Projection, StereoPair
from fuzzy_stereo_ros.synthetic.scenes import FOCAL, make_pair, make_sequence
import numpy as np

DISPARITIES = 24
ROWS, COLUMNS, FEW = 40, 72, 16     # of `known` and `small_scene`; FEW: disparities
LARGE = 240, 320, 32                # of `large_scene`, in which rows can be measured
STREET_CAMERA = Camera(FOCAL * 160, FOCAL * 160, 159 / 2, 129 / 2)
CALIBRATION = Calibration(focal=400.0, baseline=0.1, offset=-1.5,
                          left=Projection(400.0, 402.0, 170.0, 60.0))


def scene(rows=60, columns=100, seed=0, **options):
    """Return a noisy `ScenePair` of DISPARITIES."""
    return make_pair(rows, columns, DISPARITIES, seed, **{'noise': 2.0, **options})


def large_scene(noise=2.0):
    """Return a noisy `ScenePair` of LARGE."""
    return make_pair(*LARGE, seed=2, objects=6, noise=noise)


@cache
def street():
    """Return six `ScenePair`s of DISPARITIES behind STREET_CAMERA, which drives and turns."""
    return list(make_sequence(130, 160, DISPARITIES, 6, 1, noise=1.0, drive=0.08, pan=2.0))


def shifted_pair(shift, rows=60, columns=120, seed=0):
    """Return two textured uint8 images (R, C) of one disparity everywhere."""
    texture = np.random.default_rng(seed).integers(20, 235, (rows, columns + shift), np.uint8)
    return (np.ascontiguousarray(texture[:, :columns]),
            np.ascontiguousarray(texture[:, shift:]))


def known(seed=1, size=(ROWS, COLUMNS, FEW), **options):
    """Return a `ScoredPair`; size: rows, columns, disparities."""
    return ScoredPair(*make_pair(*size, seed, **options))


def small_scene(seed=1, group='small', name=None, size=(ROWS, COLUMNS, FEW), **options):
    """Return a `Scene`, called after its seed unless it has a name."""
    return Scene(group, name or f'seed{seed}', MIDDLEBURY, size[2],
                 partial(known, seed, size, **options))


def noisy(images, sigma, random):
    """Return images with normal noise of sigma grey levels in each value, uint8."""
    return [np.clip(np.rint(image + random.normal(0, sigma, image.shape)), 0, 255).astype(
        np.uint8) for image in images]


def matched(pair, config, **changes):
    """Return the cold match of a pair; changes: of the configuration."""
    return StereoMatcher(replace(config, **changes)).match(pair.left, pair.right)


def matches_of(matcher, pairs, camera=None):
    """Return the matches of pairs, one after the other."""
    return [matcher.match(pair.left, pair.right, camera=camera) for pair in pairs]


def made_matched(rows=60, columns=330, stamp=1_250_000_000, reference='left', **options):
    """
    Return a MatchedPair with the true disparities, invalid where hidden, and a ramp as confidence.

    options: those of `make_pair`.
    """
    made = make_pair(rows, columns, DISPARITIES, **options)
    disparity = np.where(made.visible, made.truth, np.nan).astype(np.float32)
    confidence = np.tile(np.linspace(0, 1, columns, dtype=np.float32), (rows, 1))
    return MatchedPair(StereoPair(made.left, made.right, CALIBRATION, stamp),
                       Match(disparity, confidence, [], {}, False),
                       MatcherConfig(disparities=DISPARITIES, reference=reference), None, Rows())


def bits(match):
    """Return all of a match that must not differ, for comparisons to the last bit."""
    return (match.disparity.tobytes(), match.confidence.tobytes(), match.warm, [
        (row.best_fitness, row.mean_fitness, row.gains) for row in match.history])


def wrong(match, pair):
    """Return the percent of the visible pixels that are off by more than one pixel."""
    return score(match.disparity, pair.truth, pair.visible).bad_dense[1.0]


def film(path):
    """Return the frames of a video, and its rate."""
    video, frames = cv2.VideoCapture(str(path)), []
    while (read := video.read())[0]:
        frames.append(read[1])
    return frames, video.get(cv2.CAP_PROP_FPS)
