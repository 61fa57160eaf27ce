# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Made scenes are exact: what the truth says is what the images show."""
from functools import cache

import cv2
from fuzzy_stereo_ros.synthetic.scenes import make_pair, make_sequence
from hypothesis import given, settings, strategies as st
import numpy as np
import pytest


@cache
def driven(frames, seed, **options):
    return list(make_sequence(120, 160, 32, frames, seed, drive=0.1, pan=2.0, **options))


@pytest.mark.parametrize('seed, frame', [(0, None), (1, None), (2, 0), (2, 2)])
def test_the_right_image_moved_by_the_truth_and_by_no_other_is_the_left_image_where_visible(
        seed, frame):
    """With a frame: of a drive."""
    pair = make_pair(150, 201, 40, seed, colour=True) if frame is None else driven(
        3, seed, colour=True, objects=8)[frame]
    y, x = np.indices(pair.truth.shape, np.float32)
    moved = (cv2.remap(pair.right, x - pair.truth - shift, y, cv2.INTER_CUBIC).astype(int)
             for shift in (0, -1, 1))
    difference, less, more = (abs(image - pair.left).max(axis=2) for image in moved)
    assert np.median(difference[pair.visible]) <= 2
    assert np.percentile(difference[pair.visible], 95) <= 12
    assert np.median(difference[~pair.visible]) > 12
    for wrong in (less, more):
        assert wrong[pair.visible].mean() > 3 * difference[pair.visible].mean()
    assert 0.6 < pair.visible.mean() < 0.99


@settings(max_examples=15)
@given(rows=st.integers(1, 40), columns=st.integers(1, 60), share=st.floats(0, 1),
       low=st.integers(-20, 20), seed=st.integers(0, 1000), bits=st.sampled_from([8, 12, 16]),
       colour=st.booleans(), thin=st.integers(0, 5))
def test_any_size_gives_what_was_asked_for(rows, columns, share, low, seed, bits, colour, thin):
    disparities = 1 + int(share * (columns - 1))
    pair = make_pair(rows, columns, disparities, seed, min_disparity=low, bits=bits,
                     colour=colour, poles=thin)
    shape = (rows, columns, 3) if colour else (rows, columns)
    for image in (pair.left, pair.right):
        assert image.shape == shape
        assert image.dtype == (np.uint8 if bits == 8 else np.uint16)
        assert image.max() <= 2**bits - 1
    assert pair.truth.shape == pair.visible.shape == (rows, columns)
    assert pair.truth.dtype == np.float32 and pair.visible.dtype == bool
    assert low - 1e-4 <= pair.truth.min() <= pair.truth.max() <= low + disparities - 1 + 1e-4


@pytest.mark.parametrize('drive', [0.0, 0.1])
def test_the_same_seed_gives_the_same_bits_and_another_seed_does_not(drive):
    options = {'drive': drive, 'pan': 2.5, 'motion': 3, 'noise': 4, 'flicker': 0.2, 'colour': True}
    first, again = (list(make_sequence(40, 60, 16, 2, 7, **options)) for _ in range(2))
    assert all(map(np.array_equal, sum(first, ()), sum(again, ())))
    assert not np.array_equal(first[0].truth, make_pair(40, 60, 16, 8, drive=drive).truth)


def test_a_pan_moves_the_whole_scene_by_its_pixels():
    before, after = make_sequence(40, 90, 16, 2, 2, pan=4)
    assert np.allclose(before.truth[:, 4:], after.truth[:, :-4], atol=1e-4)
    assert np.abs(before.left[:, 4:].astype(int) - after.left[:, :-4]).max() <= 1


def test_noise_is_as_strong_as_asked_and_fresh_in_every_image():
    clean = make_pair(100, 120, 16, 4)
    first, second = make_sequence(100, 120, 16, 2, 4, noise=5)
    for image, plain in ((first.left, clean.left), (first.right, clean.right),
                         (second.left, clean.left)):
        assert 4.5 < (image.astype(float) - plain).std() < 5.5
    assert np.corrcoef((first.left.astype(float) - clean.left).ravel(),
                       (second.left.astype(float) - clean.left).ravel())[0, 1] < 0.1


def test_exposure_changes_the_right_image_and_flicker_both():
    clean = make_pair(60, 80, 16, 4)
    darker = make_pair(60, 80, 16, 4, exposure=0.5)
    assert np.array_equal(darker.left, clean.left)
    assert abs(darker.right.mean() / clean.right.mean() - 0.5) < 0.02
    still = list(make_sequence(60, 80, 16, 3, 4, flicker=0.3))
    assert still[2].left.mean() > 1.15 * still[0].left.mean()
    assert still[2].right.mean() > 1.15 * still[0].right.mean()


@pytest.mark.parametrize('options, words', [
    ({'disparities': 11}, 'disparities is 11; allowed are 1 to the 10 columns'),
    ({'bits': 17}, 'bits is 17; allowed are whole numbers from 8 to 16'),
    ({'poles': 2, 'drive': 0.1}, 'poles is 2 and drive is 0.1; a street has no poles'),
    ({'offset': 8.0, 'drive': 0.1}, 'offset is 8.0 and drive is 0.1; a street has no offset')])
def test_what_cannot_be_made_is_rejected_with_a_sentence(options, words):
    with pytest.raises(ValueError, match=words):
        make_pair(**{'rows': 10, 'columns': 10, 'disparities': 4, **options})
