# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The film at the top of the README: a disparity map that grows out of noise while frames arrive.

`python -m bench.film docs/evolution.webp` matches frames of the Motorcycle pair of scikit-image,
each with noise of its own, by the profile `paper_live`. The first frame begins with random maps,
each later one with the population of the one before, and evolves it for a few generations.
"""
import sys

from bench.datasets import MOTORCYCLE_DISPARITIES, read_motorcycle
from bench.draws import with_noise
from bench.scoring import bad_percent, ScoredPair
import cv2
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.views.video import image_beside_disparity
import numpy as np

FRAMES, GENERATIONS = 16, 3     # a frame, fewer than the profile has: the eye can follow them
NOISE = 1.5                     # grey levels
SIZE = 400, 270                 # px, width and height of a panel
MILLISECONDS, STAY = 350, 2500  # that a frame and the last one are shown
QUALITY = 60                    # of WebP


def frames():
    """Yield the pictures of the film: uint8 (R, C, 3) BGR."""
    pair = read_motorcycle()
    scale = SIZE[0] / pair.left.shape[1]
    left, right = (cv2.resize(image, SIZE, interpolation=cv2.INTER_AREA)
                   for image in (pair.left, pair.right))
    truth = scale * cv2.resize(pair.truth, SIZE, interpolation=cv2.INTER_NEAREST)
    seen = cv2.resize(pair.counts.astype(np.uint8), SIZE, interpolation=cv2.INTER_NEAREST) > 0
    pair = ScoredPair(left, right, truth, seen)
    disparities = round(scale * MOTORCYCLE_DISPARITIES)
    matcher = StereoMatcher(MatcherConfig.from_profile(
        'paper_live', disparities=disparities, generations=GENERATIONS, fill=True))
    random = np.random.default_rng(0)
    for number in range(1, FRAMES + 1):
        views = [with_noise(image, NOISE, random) for image in (left, right)]
        disparity = matcher.match(*views).disparity
        wrong = bad_percent(disparity, pair, 1.0)
        yield image_beside_disparity(
            views[0], disparity, 0, disparities - 1, f'frame {number} of {FRAMES}',
            f', {wrong:.0f} % off by more than 1 px')


def write_film(path, pictures):
    """Write pictures, uint8 (R, C, 3) BGR, as a film that repeats: .webp or .gif."""
    from PIL import Image

    first, *others = (Image.fromarray(picture[:, :, ::-1]) for picture in pictures)
    first.save(path, save_all=True, append_images=others, quality=QUALITY, method=6, loop=0,
               duration=[MILLISECONDS] * len(others) + [STAY])


if __name__ == '__main__':
    write_film(sys.argv[1], frames())
