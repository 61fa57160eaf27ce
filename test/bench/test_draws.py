# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Figures with noise are means of draws, alike for all, the worst beside; warm has no bias."""
from collections import namedtuple

from bench.conditions import under_condition
from bench.datasets import MADE, MADE_SEEDS
from bench.draws import Drawn, means_over_draws, with_draw
from bench.layers import BACKGROUND, make_layers
from bench.request import Request
from bench.scoring import ScoredPair
from made_scenes import small_scene
import numpy as np
import pandas as pd
import pytest

Item = namedtuple('Item', ('name', 'noise'))


def twice(item, draw):
    return [{'name': item.name}] * 2


@pytest.mark.parametrize(('worst', 'of_draws'), [('max', max), ('min', min)])
def test_scenes_are_averaged_within_a_draw_and_the_worst_draw_stands_beside_the_mean(
        worst, of_draws):
    random = np.random.default_rng()
    draws = dict(zip(random.permutation(list('abcdef')), (1, 2, 8, 1, 3, 5)))
    errors = {name: random.uniform(0, 99, (number, random.integers(1, 4)))
              for name, number in draws.items()}
    frame = pd.DataFrame([
        {'name': name, 'scene': scene, 'draw': draw, 'error': error}
        for name, several in errors.items() for draw, scenes in enumerate(several)
        for scene, error in enumerate(scenes)])
    found = means_over_draws(frame, ['name'], worst=worst).error
    assert list(found.index) == list(errors)
    for name, several in errors.items():
        each = several.mean(axis=1)
        printed = f'{each.mean():.2f} ({of_draws(each):.2f})'
        assert f'{found[name]:.2f}' == (printed if len(each) > 1 else printed.split()[0])
        assert isinstance(found[name], Drawn) == (len(each) > 1)


def test_what_has_noise_is_matched_for_each_draw_and_what_has_none_once():
    items = [Item('a', 1.5), Item('b', 0), Item('c', True)]
    found, none = Request(draws=3).drawn((items, '', twice), ([], '', twice))
    assert list(found.name) == [*'aaaaaa', *'bb', *'cccccc']
    assert list(found.draw) == [0, 0, 1, 1, 2, 2, 0, 0, 0, 0, 1, 1, 2, 2]
    assert none.empty


@pytest.mark.parametrize('make', [
    lambda pair, draw: with_draw([pair], 1.5, draw)[0],
    lambda pair, draw: with_draw([pair], 1.5, draw, alike=False)[0],
    lambda pair, draw: under_condition(pair, 'shot and read noise, unlike columns', draw),
    lambda pair, draw: under_condition(pair, 'a sixth of the light', draw)])
def test_a_draw_is_the_same_each_time_and_others_differ(make):
    pair = small_scene().read()
    first, again, other = (make(pair, draw) for draw in (3, 3, 4))
    for side in ('left', 'right'):
        assert np.array_equal(getattr(first, side), getattr(again, side))
        assert np.mean(getattr(first, side) != getattr(other, side)) > 0.5


OUTLIER = 2.0       # px from which an error is no bias


@pytest.mark.slow
@pytest.mark.parametrize('contrast, speed', [(8, 0.02), (5, 0.05)])     # grey levels, px a frame
def test_what_comes_nearer_slowly_in_little_contrast_has_no_bias(contrast, speed):
    biases = []
    for seed in MADE_SEEDS:
        matcher = Request().ours.matcher(MADE['disparities'], warm_start=True)
        frames = with_draw([ScoredPair(*made) for made in make_layers(
            MADE['rows'], MADE['columns'], 40, seed, contrast, 1.5, approach=speed)], 2.0, 0)
        for number, made in enumerate(frames):
            off = matcher.match(made.left, made.right).disparity - made.truth
            counts = made.counts & (made.truth > BACKGROUND) & (abs(off) < OUTLIER)
            if number >= 4:
                biases.append(off[counts].mean())
    assert abs(np.mean(biases)) < 0.15
