# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Tuning: the settings of OpenCV's matchers with the smallest error on half of the scenes.

From the settings of evaluation/baselines.py on, all combinations of the values of one group are
tried and the best is kept, then those of the next group, until a round of all groups changes
nothing. The error is the mean over groups of scenes of that of the dense map, with and without
noise, of one draw. Only the odd scenes of groups with several are looked at; the others, and other
draws, show whether the settings hold elsewhere.
"""
from dataclasses import replace
from itertools import product

from bench.draws import in_words, over_draws, with_draw
from bench.request import report_of
from bench.scoring import bad_percent
from fuzzy_stereo_ros.evaluation.baselines import (
    ALGORITHMS, dense, PreparedBaseline, TUNED_SETTINGS)
from fuzzy_stereo_ros.evaluation.report import Table
import pandas as pd

NOISES = 0, 1.5         # grey levels, standard deviation
# Groups of values that are tried together; p1: of the square of the block's side, ratio: P2 / P1.
OF_ALL = ({'uniqueness': (0, 5, 10, 15)}, {'left_right': (-1, 0, 1, 2)},
          {'speckle_size': (0, 100, 400)}, {'speckle_range': (1, 2, 4)})
BLOCK_MATCHING = ({'block': (7, 9, 11, 13, 15, 17, 21)}, {'cap': (7, 15, 31, 63)},
                  {'texture': (0, 5, 10, 20)}, *OF_ALL)
SEMI_GLOBAL = ({'p1': (1, 2, 4, 8, 16), 'ratio': (2, 3, 4, 6, 8)}, {'block': (3, 5, 7, 9)},
               {'cap': (7, 15, 31, 63)}, *OF_ALL)


class Scenes:
    """Scenes of a family, without and with the noise of a draw, on which settings are tried."""

    def __init__(self, scenes, draw):
        """Read the scenes; no two need be of one size."""
        self.scenes = [(scene.group, scene.limit, scene.disparities, [
            pair for noise in NOISES for pair in with_draw([scene.read()], noise, draw, False)])
            for scene in scenes]
        self.known = {}

    def error(self, algorithm, settings):
        """Return the error of `Settings` in percent; NaN without scenes."""
        if (algorithm, settings) not in self.known:
            errors = pd.DataFrame(
                [(group, bad_percent(dense(matcher.match(pair.left, pair.right)), pair, limit))
                 for group, limit, disparities, pairs in self.scenes
                 for matcher in [PreparedBaseline(algorithm, settings, disparities, padded=True)]
                 for pair in pairs], columns=['group', 'error'])
            self.known[algorithm, settings] = float(
                errors.groupby('group').error.mean().astype(float).mean())
        return self.known[algorithm, settings]


def run(request):
    """Return the `Report` of the settings found for each family of the scenes of a `Request`."""
    scenes, skipped = request.scenes()
    families = dict.fromkeys(scene.family for scene in scenes)
    halves = {family: [[Scenes(half, draw) for draw in range(request.draws)]
                       for half in odd_and_even([scene for scene in scenes
                                                 if scene.family == family])]
              for family in families}
    rows = request.each([*product(families, ALGORITHMS)], 'tuning',
                        lambda one: row_of(*one, *halves[one[0]]))
    return report_of('tuning', "Tuning of OpenCV's matchers", {
        'error': 'mean over groups of the percentage of wrong pixels of dense maps, as of '
                 f'accuracy, at a noise of {" and ".join(f"{noise:g}" for noise in NOISES)} grey '
                 'levels, padded',
        **in_words(request.draws),
        'odd': 'scenes 1, 3, 5 and so on of each group with several: settings are chosen on them',
        'even': 'all others, groups of one scene among them',
        'tried': 'all combinations of one group of values after another, until a round of all '
                 'groups changes nothing: bench/tuning.py',
    }, [Table.of('Settings with the smallest error on odd scenes',
                 pd.DataFrame(rows, dtype=object).set_index('matcher'),
                 'P1 is a multiple of the square of the side of the block. Before: of the '
                 'settings of evaluation/baselines.py. Those found take their place where the '
                 'mean of odd and even gets smaller: of KITTI the halves are two pairs each.')],
        skipped)


def odd_and_even(scenes):
    """Return the odd scenes of each group with several, and all others."""
    groups = {}
    for scene in scenes:
        groups.setdefault(scene.group, []).append(scene)
    odd = [scene for those in groups.values() if len(those) > 1 for scene in those[::2]]
    return odd, [scene for scene in scenes if scene not in odd]


def row_of(family, algorithm, odd, even):
    """Return the row of a matcher: settings and errors; odd, even: `Scenes` of each draw."""
    before = TUNED_SETTINGS[family][algorithm]
    found = descend(before, BLOCK_MATCHING if algorithm == 'BM' else SEMI_GLOBAL,
                    lambda settings: odd[0].error(algorithm, settings))
    penalties = {} if algorithm == 'BM' else {
        'P1': found.p1 // found.block**2, 'P2 / P1': found.p2 // found.p1}
    return {'matcher': f'{family}, {algorithm}', 'block': found.block, **penalties,
            'cap': found.cap, 'uniqueness': found.uniqueness, 'left-right': found.left_right,
            'speckle size': found.speckle_size, 'speckle range': found.speckle_range,
            'texture': found.texture if algorithm == 'BM' else None,
            **dict(zip(('error, odd', 'error, even', 'before, odd', 'before, even'), over_draws(
                pd.DataFrame([[one.error(algorithm, settings) for one in half]
                              for settings in (found, before) for half in (odd, even)]))))}


def descend(settings, groups, error):
    """Return the `Settings` that no group of values makes better; error: function of them."""
    while True:
        before = settings
        for values in groups:
            tried = [changed(settings, dict(zip(values, chosen)))
                     for chosen in product(*values.values())]
            settings = min((settings, *tried), key=error)
        if settings == before:
            return settings


def changed(settings, values):
    """Return `Settings` with other values, by the names in SEMI_GLOBAL and BLOCK_MATCHING."""
    others = {'block': settings.block, **values}
    p1 = others.pop('p1', settings.p1 // settings.block**2) * others['block'] ** 2
    ratio = others.pop('ratio', settings.p2 // max(settings.p1, 1))
    return replace(settings, p1=p1, p2=ratio * p1, **others)
