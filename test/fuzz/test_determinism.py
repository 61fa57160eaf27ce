# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Equal input gives equal bits in every process: docs/architecture.md says how far that goes."""
from dataclasses import replace
import platform
from random import Random

from drawn_frames import frames_of, options, SCENES
from fuzzed import examples, is_long
from fuzzy_stereo_ros.matching import PROFILES, StereoMatcher
from fuzzy_stereo_ros.matching.bands import ThreadPool
from hypothesis import given, Phase, settings, strategies as st
from made_scenes import bits
import numpy as np
import pytest
from repository import printed_by, ROOT

PROGRAM = ROOT / 'test' / 'support' / 'match_digests.py'
LONG = pytest.mark.skipif(not is_long(), reason='compiling all kernels takes minutes: make fuzz')
X86 = pytest.mark.skipif(platform.machine() != 'x86_64', reason='names features of x86-64')


# ---- any number of threads ----


def results(config, pairs):
    """Return all that pairs leave: bits of matches and of states."""
    matcher, found = StereoMatcher(config), []
    for number, pair in enumerate(pairs):
        match, state = matcher.match(*pair, stamp=number + 1), matcher.state
        found.append((*bits(match), match.misalignment, state and {
            name: array.tobytes() for name, array in state.arrays().items()}))
    return found


@examples(20)
@given(st.sampled_from(sorted(PROFILES)).flatmap(options), SCENES, st.integers(3, 8))
def test_threads_change_no_bit_of_a_sequence(config, scene, many):
    config = replace(config, disparities=min(config.disparities, scene['columns']))
    pairs = frames_of(config, scene)
    alone, *others = (results(replace(config, threads=threads), pairs)
                      for threads in (1, 2, many))
    assert others[0] == alone and others[1] == alone


def run_in_any_order(random, work, items, needs):
    """Do what `ThreadPool.run` does, item by item, in an order in which threads may do them."""
    left = list(range(len(items)))
    while left:
        index = random.choice([one for one in left if needs[one] <= left[0]])
        work(items[index])
        left.remove(index)


@pytest.mark.quick
@settings(examples(16), deadline=None, phases=[Phase.generate])     # some compile a kernel
@given(st.sampled_from(['realtime', 'fast']).flatmap(options), SCENES, st.integers(120, 400),
       st.integers(3, 8), st.integers(0, 99))
def test_any_order_that_stages_allow_gives_the_bits_of_one_thread(
        config, scene, rows, many, seed):
    """Half of each picture is noise, of which each stage rejects some in all rows."""
    config = replace(config, disparities=min(config.disparities, scene['columns']))
    pairs, noise = frames_of(config, {**scene, 'rows': rows}), np.random.default_rng(seed)
    for image in (image for pair in pairs for image in pair):
        half = image[:, :image.shape[1] // 2]
        half[:] = noise.integers(100, 130, half.shape)
    alone, random = results(replace(config, threads=1), pairs), Random(seed)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ThreadPool, 'run', lambda pool, *call: run_in_any_order(random, *call))
        for _ in range(4):
            assert results(replace(config, threads=many), pairs) == alone


# ---- any process ----


def digests(threads, *options, number=33, **variables):
    """Return what the program prints, lines of profile, kind, frame and digest, so many."""
    lines = printed_by(PROGRAM, f'--threads={threads}', *options, **variables).splitlines()
    assert len(set(lines)) == len(lines) == number
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
        images):
    usual, older = ([line for line in digests(
        threads, images, 'realtime', 'paper', number=15, **variables)
        if 'paper, colour' not in line]
        for threads, variables in ((1, {}), (2, {
            'OPENCV_CPU_DISABLE': 'AVX2,FMA3,FP16,AVX', 'NPY_DISABLE_CPU_FEATURES': 'AVX2 FMA3'})))
    assert older == usual
