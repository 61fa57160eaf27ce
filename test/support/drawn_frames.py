# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Strategies of what users bring: configurations, and short sequences as cameras send them."""
import cv2
from fuzzy_stereo_ros.matching import MatcherConfig
from hypothesis import strategies as st
import numpy as np

ROWS, COLUMNS = (st.one_of(st.integers(2, 130), st.integers(120, most)) for most in (480, 240))
FAULTS = 'torn', 'plain', 'dark', 'clipped', 'lower'


def options(profile):
    """Return a strategy of what changes the results of a profile, without time limits."""
    paper = {'population': st.integers(1, 5), 'generations': st.integers(0, 2),
             'neighbourhood': st.sampled_from([3, 25]), 'disparities': st.integers(1, 20),
             'reading': st.sampled_from(['literal', 'uniform'])} if 'paper' in profile else {}
    return st.fixed_dictionaries({
        'disparities': st.integers(1, 80), 'min_disparity': st.sampled_from([0, 0, -7, 5, 40]),
        'fill': st.booleans(), 'fill_holes': st.sampled_from([0, 300]),
        'reference': st.sampled_from(['left', 'right']), 'seed': st.integers(0, 9),
        'confidence_threshold': st.sampled_from([0.0, 0.5]), 'align_rows': st.booleans(),
        'speckle_size': st.sampled_from([0, 9, 100]), 'speckle_range': st.integers(0, 3),
        'warm_start': st.booleans(), 'still_interval': st.integers(1, 4),
        'generations': st.sampled_from([1, 4]), **paper}).map(
            lambda chosen: MatcherConfig.from_profile(profile, **chosen))


SCENES = st.fixed_dictionaries({
    'rows': ROWS, 'columns': COLUMNS, 'seed': st.integers(0, 2**32 - 1),
    'colour': st.booleans(), 'depth': st.sampled_from([8, 8, 9, 12, 16]),
    'pan': st.integers(0, 3), 'near': st.floats(0, 1), 'blur': st.floats(0.5, 6),
    'noise': st.sampled_from([0.0, 0.0, 1.5, 6.0]), 'jpeg': st.sampled_from([None, None, 40, 95]),
    'faults': st.dictionaries(st.sampled_from(FAULTS), st.tuples(
        st.floats(0, 1), st.floats(0, 1)), max_size=3)})     # of some rows: first and number


def frames_of(config, scene):
    """Return three pairs of a surface that pans, as cameras with faults send them."""
    random, size = np.random.default_rng(scene['seed']), (scene['rows'], scene['columns'])
    shift = config.min_disparity + round(scene['near'] * (config.disparities - 1))
    wide = cv2.GaussianBlur(random.normal(size=(
        size[0], size[1] + abs(shift) + 3 * scene['pan'], 3)[:2 + scene['colour']]), None,
        scene['blur'])
    wide = np.interp(wide, (wide.min(), wide.max()), (5, 250))
    return [[_seen(wide[:, max(side * shift, (side - 1) * shift) + frame * scene['pan']:][
        :, :size[1]].copy(), side, scene, random) for side in range(2)] for frame in range(3)]


def _seen(image, right, scene, random):
    """Return a view as a camera with faults sends it: uint8 or uint16."""
    for fault, (begin, height) in scene['faults'].items():
        first = int(begin * len(image))
        band = image[first:first + 1 + int(height * len(image))]
        if fault == 'torn' and right:
            band[:] = random.integers(0, 256, band.shape)
        elif fault == 'lower' and right:
            image = np.roll(image, 2, axis=0)
        elif fault == 'plain':
            band[:] = 100
        elif fault in ('dark', 'clipped'):
            image = image * (0.05 if fault == 'dark' else 3)
    image = np.clip(image + scene['noise'] * random.standard_normal(image.shape), 0, 255)
    if scene['depth'] > 8:
        return np.rint(image * ((2**scene['depth'] - 1) / 255)).astype(np.uint16)
    image = np.rint(image).astype(np.uint8)
    return image if scene['jpeg'] is None else cv2.imdecode(cv2.imencode('.jpg', image, [
        cv2.IMWRITE_JPEG_QUALITY, scene['jpeg']])[1], cv2.IMREAD_UNCHANGED)
