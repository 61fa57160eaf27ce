# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""OpenCV's matchers are tuned on half of the scenes, by the values that the baselines have."""
from dataclasses import replace

from fuzzy_stereo_ros.benchmarks import tuning
from fuzzy_stereo_ros.evaluation.baselines import ALGORITHMS, Settings, TUNED_SETTINGS
from fuzzy_stereo_ros.evaluation.ground_truth import MIDDLEBURY
import pytest
from small_scenes import assert_columns_have_names_of_their_own, request_for, small_scene

SCENES = [small_scene(seed) for seed in (1, 2)]


def groups_of(algorithm):
    return tuning.BLOCK_MATCHING if algorithm == 'BM' else tuning.SEMI_GLOBAL


def multiples(settings):
    """Return the values of settings by the names of the groups."""
    p1 = settings.p1 // settings.block**2
    return {**vars(settings), 'p1': p1, 'ratio': settings.p2 // max(settings.p1, 1)}


def test_odd_scenes_of_each_group_with_several_are_tuned_on():
    scenes = [replace(small_scene(seed), group=group, name=f'{group}{seed}')
              for seed, group in enumerate('aababc')]
    odd, even = tuning.odd_and_even(scenes)
    assert [scene.name for scene in odd] == ['a0', 'a3', 'b2']
    assert [scene.name for scene in even] == ['a1', 'b4', 'c5']


def test_penalties_are_multiples_of_the_square_of_the_side_of_the_block():
    settings = tuning.changed(Settings(), {'block': 5, 'p1': 2, 'ratio': 8, 'cap': 7})
    assert settings == Settings(block=5, p1=50, p2=400, cap=7)
    assert tuning.changed(settings, {}) == settings
    assert tuning.changed(settings, {'block': 3}) == replace(settings, block=3, p1=18, p2=144)
    assert tuning.changed(settings, {'p1': 4}) == replace(settings, p1=100, p2=800)


def test_the_descent_ends_at_the_least_error_and_stays_there():
    best = {'block': 7, 'p1': 16, 'ratio': 3, 'cap': 31, 'uniqueness': 10, 'left_right': 2,
            'speckle_size': 400, 'speckle_range': 4}

    def error(settings):
        return sum(abs(multiples(settings)[name] - value) for name, value in best.items())

    found = tuning.descend(TUNED_SETTINGS[MIDDLEBURY]['3WAY'], tuning.SEMI_GLOBAL, error)
    assert error(found) == 0
    assert tuning.descend(found, tuning.SEMI_GLOBAL, lambda settings: 1.0) is found


@pytest.mark.parametrize('family', TUNED_SETTINGS)
@pytest.mark.parametrize('algorithm', ALGORITHMS)
def test_the_tuned_settings_are_among_those_that_are_tried(family, algorithm):
    values = multiples(TUNED_SETTINGS[family][algorithm])
    for group in groups_of(algorithm):
        for name, tried in group.items():
            assert values[name] in tried, name


def test_the_report_has_the_error_of_both_halves_and_none_is_worse_than_before(monkeypatch):
    monkeypatch.setattr(tuning, 'SEMI_GLOBAL', ({'p1': (2, 8), 'ratio': (2, 8)},))
    monkeypatch.setattr(tuning, 'BLOCK_MATCHING', ({'block': (7, 13), 'cap': (15, 31)},))
    report = tuning.run(request_for(SCENES)())
    assert_columns_have_names_of_their_own(report)
    (table,) = report.tables
    assert [row[0] for row in table.rows] == [f'{MIDDLEBURY}, {name}' for name in ALGORITHMS]
    odd, even = (tuning.Scenes([scene]) for scene in SCENES)
    for algorithm, row in zip(ALGORITHMS, table.rows):
        values = dict(zip(table.columns, row))
        assert values['error, odd'] <= values['before, odd']
        before = TUNED_SETTINGS[MIDDLEBURY][algorithm]
        assert values['before, odd'] == odd.error(algorithm, before)
        assert values['before, even'] == even.error(algorithm, before)
