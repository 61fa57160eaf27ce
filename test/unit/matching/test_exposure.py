# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The colours of the right image as the left camera would have exposed them."""
import cv2
from fuzzy_stereo_ros.matching.match import Match
from fuzzy_stereo_ros.matching.quality.exposure import exposed_alike
import numpy as np
import pytest

SIZE, DISPARITY = (120, 160), 12


def shading(image):
    """Return an image that is darker towards its right edge and its corners."""
    across, down = np.linspace(-1, 1, SIZE[1]), np.linspace(-1, 1, SIZE[0])[:, None]
    return image * (0.8 - 0.1 * across - 0.15 * (across**2 + down**2))[..., None]


EXPOSURES = {'gain and offset': lambda image: 0.7 * image - 8,
             'gamma': lambda image: 255 * (image / 255)**1.4,
             'dark corners': shading}


def pair_of(exposure, wrong=0.0, seed=0):
    """Return the left and the right colours, the right ones of one exposure, and a Match."""
    # wrong: share of the matches that are any other
    random = np.random.default_rng(seed)
    wide = cv2.GaussianBlur(random.uniform(0, 255, (SIZE[0], SIZE[1] + DISPARITY, 3)), None, 4)
    wide = np.interp(wide, (wide.min(), wide.max()), (40, 220))
    left, alike = wide[:, :SIZE[1]], wide[:, DISPARITY:]
    disparity = np.full(SIZE, DISPARITY, np.float32)
    elsewhere = random.random(SIZE) < wrong
    disparity[elsewhere] = random.integers(0, 60, SIZE)[elsewhere]
    match = Match(disparity, np.ones(SIZE, np.float32), [], {}, False)
    return (*(np.rint(image).astype(np.uint8) for image in (left, exposure(alike))),
            np.rint(alike).astype(np.uint8), match)


@pytest.mark.parametrize('exposure', EXPOSURES)
@pytest.mark.parametrize('wrong', [0, 0.3])
def test_another_exposure_is_undone_though_matches_are_wrong(exposure, wrong):
    left, right, alike, match = pair_of(EXPOSURES[exposure], wrong)
    before, after = (abs(image.astype(float) - alike).mean()
                     for image in (right, exposed_alike(left, right, match)))
    assert before > 20
    assert after < 2


@pytest.mark.parametrize('gain', [1.0, 0.96])
def test_colours_of_cameras_that_differ_little_stay_as_they_are(gain):
    left, right, _, match = pair_of(lambda image: gain * image)
    assert exposed_alike(left, right, match) is right
