# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The balance: what a part earns is what the error without it says, where it can be told."""
from dataclasses import replace
from functools import partial

from fuzzy_stereo_ros.benchmarks import balance
from fuzzy_stereo_ros.benchmarks.balance import balance_table, evolution_tables, PARTS, Work
from fuzzy_stereo_ros.benchmarks.datasets import window
from fuzzy_stereo_ros.benchmarks.request import Trial
from fuzzy_stereo_ros.benchmarks.variants import DEFAULT, REALTIME
from fuzzy_stereo_ros.evaluation.datasets import Sequence
from fuzzy_stereo_ros.evaluation.ground_truth import bad_percent, MIDDLEBURY
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
import pytest
from small_scenes import (
    assert_columns_have_names_of_their_own, DISPARITIES, request_for, small_scene)

CROSSOVER, MUTATION = (next(variant for variant in REALTIME if variant.part == part)
                       for part in ('crossover', 'mutation'))
PREVIOUS_BEST = next(variant for variant in REALTIME if variant.part == 'previous best')


def scene(group='made', name='one'):
    return small_scene(1, group, name, noise=6.0)


def sequence(kind='window, noise 6, pan 0'):
    frames = partial(window, scene(), 6, 0, frames=3)
    return Sequence(kind, 'one', MIDDLEBURY, DISPARITIES, frames, range(1, 3))


def error(value):
    return Trial(value, 0.5, 1000.0)


def rows_of(found):
    return {(row[0], row[1]): row[2:] for row in balance_table(found).rows}


def test_a_part_earns_what_the_mean_error_without_it_is_larger_in_percent_of_it():
    found = [(Work('realtime', scene(), REALTIME), {
        DEFAULT.name: error(with_it), CROSSOVER.name: error(with_it),
        MUTATION.name: error(without)})
        for with_it, without in ((1.0, 2.0), (5.0, 6.0))]
    rows = rows_of(found)
    assert rows['realtime', 'crossover'] == (CROSSOVER.name, 2, 3.0, 3.0, '+0.00')
    assert rows['realtime', 'mutation'] == (MUTATION.name, 2, 3.0, 4.0, '+25.00')


def test_the_previous_best_is_told_by_sequences_and_all_else_by_scenes():
    found = [(Work('realtime', sequence(), (DEFAULT, PREVIOUS_BEST)),
              {DEFAULT.name: error(4.0), PREVIOUS_BEST.name: error(5.0)})]
    rows = rows_of(found)
    assert rows['realtime', 'previous best'] == (PREVIOUS_BEST.name, 1, 4.0, 5.0, '+20.00')
    assert ('realtime', 'mutation') not in rows


def test_a_part_that_does_harm_has_a_sign():
    found = [(Work('realtime', scene(), REALTIME),
              {DEFAULT.name: error(5.0), CROSSOVER.name: error(4.0)})]
    assert rows_of(found)['realtime', 'crossover'][-1] == '-25.00'


def test_realtime_runs_everywhere_and_what_takes_seconds_on_few_scenes():
    scenes = [scene('middv2', 'teddy'), scene('midd2006_third', 'Midd1'),
              scene('midd2006_third', 'Aloe')]
    sequences = [sequence(), sequence('window, pan 2')]
    found = {}
    for work in balance._works(scenes, sequences, False):
        found.setdefault(work.profile, []).append(work.subject)
    assert found == {'realtime': [*scenes, sequences[0]], 'quality': scenes[:2],
                     'paper': scenes[:1]}
    quick = balance._works(scenes, sequences, True)
    assert [work.subject for work in quick if work.profile != 'realtime'] == scenes[:1] * 2


def test_a_trial_is_what_the_matcher_of_a_variant_finds():
    trials = balance._trials(Work('realtime', scene(), (DEFAULT, CROSSOVER)))
    known = scene().read()
    for variant in (DEFAULT, CROSSOVER):
        matcher = StereoMatcher(
            MatcherConfig(disparities=DISPARITIES, threads=1, fill=True), variant.stages)
        match = matcher.match(known.left, known.right)
        trial = trials[variant.name]
        assert trial.error == bad_percent(match.disparity, known, 1.0)
        assert trial.fitness == matcher.algorithm.population.fitness[0]
        assert trial.milliseconds > 0


def test_a_trial_of_a_sequence_is_the_mean_of_its_scored_frames():
    trials = balance._trials(Work('realtime', sequence(), (DEFAULT, PREVIOUS_BEST)))
    for variant in (DEFAULT, PREVIOUS_BEST):
        matcher = StereoMatcher(
            MatcherConfig(disparities=DISPARITIES, threads=1, fill=True), variant.stages)
        errors = [bad_percent(matcher.match(known.left, known.right).disparity, known, 1.0)
                  for known in sequence().read()]
        assert trials[variant.name].error == pytest.approx((errors[1] + errors[2]) / 2)


def test_the_tables_of_a_profile_hold_each_scene_and_the_difference():
    other = replace(DEFAULT, name='other')
    found = [(Work('quality', scene(name=name), (DEFAULT, other)), {
        DEFAULT.name: error(with_it), 'other': error(with_it + 1)})
        for name, with_it in (('one', 1.0), ('two', 3.0))]
    (table,) = evolution_tables('quality', found)
    assert table.columns[:4] == ('', 'one', 'two', 'mean')
    assert [row[1:5] for row in table.rows] == [(1.0, 3.0, 2.0, None), (2.0, 4.0, 3.0, '+1.00')]
    assert [row[5:] for row in table.rows] == [(1.0, '0.5000')] * 2
    assert evolution_tables('paper', found) == []


@pytest.mark.slow
def test_the_report_has_every_part_of_every_profile():
    report = balance.run(request_for([scene()], ([sequence()], []))(quick=True))
    assert [table.title.split(':')[0] for table in report.tables] == [
        'What each part of each profile earns', 'quality', 'paper']
    told = {row[:2] for row in report.tables[0].rows}
    assert told == {(profile, part) for profile in ('realtime', 'quality', 'paper')
                    for part in PARTS}
    assert_columns_have_names_of_their_own(report)
    assert report.skipped == ['a group']
