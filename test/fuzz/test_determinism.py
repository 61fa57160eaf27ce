# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Equal input gives equal bits in every process: docs/architecture.md says how far that goes."""
from dataclasses import replace
import os
import platform
import subprocess
import sys

import cv2
from fuzzed import examples, is_long
from fuzzy_stereo_ros.matching import MatcherConfig, PROFILES, StereoMatcher
from hypothesis import given, strategies as st
from made_scenes import bits
import numpy as np
import pytest
from repository import ROOT

PROGRAM = ROOT / 'test' / 'support' / 'match_digests.py'
LONG = pytest.mark.skipif(not is_long(), reason='compiling all kernels takes minutes: make fuzz')
X86 = pytest.mark.skipif(platform.machine() != 'x86_64', reason='names features of x86-64')
ROWS, COLUMNS = (st.one_of(st.integers(2, 130), st.integers(120, most)) for most in (480, 240))
FAULTS = 'torn', 'plain', 'dark', 'clipped', 'lower'


# ---- any number of threads ----


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
        'warm_start': st.booleans(), 'still_interval': st.integers(1, 4), **paper}).map(
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


def results(config, pairs):
    """Return all that pairs leave: bits of matches and of states."""
    matcher, found = StereoMatcher(config), []
    for number, pair in enumerate(pairs):
        match, state = matcher.match(*pair, stamp=number + 1), matcher.state
        found.append((*bits(match), match.misalignment, state and {
            name: array.tobytes() for name, array in state.arrays().items()}))
    return found


@examples(40)
@given(st.sampled_from(sorted(PROFILES)).flatmap(options), SCENES, st.integers(3, 8))
def test_threads_change_no_bit_of_a_sequence(config, scene, many):
    config = replace(config, disparities=min(config.disparities, scene['columns']))
    pairs = frames_of(config, scene)
    alone, *others = (results(replace(config, threads=threads), pairs)
                      for threads in (1, 2, many))
    assert others[0] == alone and others[1] == alone


# ---- any process ----


def digests(threads, *options, **variables):
    """Return what the program prints, a line of profile, kind, frame and digest each."""
    done = subprocess.run([sys.executable, str(PROGRAM), f'--threads={threads}', *options],
                          capture_output=True, text=True, check=True,
                          env={**os.environ, **variables})
    lines = done.stdout.splitlines()
    assert len(set(lines)) == 33
    return lines


@pytest.fixture(scope='module')
def images(tmp_path_factory):
    """Return the option that has several processes read the same images."""
    return f"--images={tmp_path_factory.mktemp('images') / 'images.npz'}"


@pytest.fixture(scope='module')
def usual(images):
    """Return the digests with one thread and the usual cache of kernels."""
    return digests(1, images)


@LONG
def test_a_cold_cache_gives_the_bits_of_a_warm_one(usual, tmp_path):
    cold, warm = (digests(2, NUMBA_CACHE_DIR=str(tmp_path)) for _ in range(2))
    assert cold == warm == usual


@LONG
@X86
def test_kernels_for_the_least_processor_give_the_same_bits(usual, tmp_path):
    assert digests(2, NUMBA_CACHE_DIR=str(tmp_path), NUMBA_CPU_NAME='x86-64',
                   NUMBA_CPU_FEATURES='') == usual


@X86
def test_opencv_and_numpy_for_an_older_processor_change_no_bit_of_realtime_and_of_paper_in_grey(
        usual, images):
    older = digests(2, images, OPENCV_CPU_DISABLE='AVX2,FMA3,FP16,AVX',
                    NPY_DISABLE_CPU_FEATURES='AVX2 FMA3')
    kept = 'realtime', 'paper, grey'
    assert [line for line in older if line.startswith(kept)] == [
        line for line in usual if line.startswith(kept)]
