# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Anytime: each curve begins where its profile does, ends in time, and is measured alike."""
from contextlib import suppress

from fuzzy_stereo_ros.benchmarks import anytime
from fuzzy_stereo_ros.benchmarks.anytime import curve_of, sample_at, STARTS
from fuzzy_stereo_ros.benchmarks.pictures import apart
from fuzzy_stereo_ros.benchmarks.request import Trial
from fuzzy_stereo_ros.evaluation.ground_truth import bad_percent
from fuzzy_stereo_ros.evaluation.matchers import Ours
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
import numpy as np
import pytest
from small_scenes import (
    assert_columns_have_names_of_their_own, DISPARITIES, known, request_for, small_scene)

KNOWN = known()


@pytest.mark.parametrize('start', STARTS, ids=lambda start: start.name)
def test_a_curve_has_the_fittest_of_each_generation_and_ends_when_time_is_up(start):
    notes = curve_of(start, small_scene(), KNOWN, 2000)
    times = [milliseconds for milliseconds, _ in notes]
    assert times == sorted(times)
    assert times[-1] < 10_000
    matcher = StereoMatcher(MatcherConfig.from_profile(start.profile, **{
        'disparities': DISPARITIES, 'reference': 'left', 'threads': 1, **start.changes}))
    rest = iter(notes)

    def observe(_, genes):
        _, noted = next(rest)       # StopIteration ends the second run where the first one ended
        np.testing.assert_array_equal(genes[matcher.algorithm.population.best], noted)

    with suppress(StopIteration):
        matcher.match(KNOWN.left, KNOWN.right, observe=observe)
    assert notes and next(rest, None) is None


def test_a_curve_without_a_generation_has_no_sample():
    assert curve_of(Ours('none', 'realtime', {'generations': 0}), small_scene(), KNOWN, 60) == []


def test_the_fitness_of_every_start_and_of_the_baseline_is_that_of_realtime():
    found = anytime.measure(small_scene(), 2000)
    judge = StereoMatcher(MatcherConfig(disparities=DISPARITIES, threads=1))
    judge.match(KNOWN.left, KNOWN.right)
    ours = judge.algorithm.population
    (sample,) = found.samples['realtime']
    assert sample.fitness == judge.algorithm.fitness_of(ours.genes[ours.best])
    assert sample.error == bad_percent(ours.genes[ours.best].astype(np.float32), KNOWN, 1.0)
    assert found.truth[0] < 1
    for samples in (*found.samples.values(), [found.baseline]):
        assert all(sample.fitness < 1 and 0 < sample.error <= 100 for sample in samples)


def test_what_was_had_at_a_time_is_the_last_that_was_reached_before():
    samples = [Trial(50.0, 0.1, 3.0), Trial(40.0, 0.2, 8.0)]
    assert sample_at(samples, 2) is None
    assert sample_at(samples, 5) is samples[0]
    assert sample_at(samples, 8) is samples[1]


def test_the_classic_pairs_and_one_of_2006_are_shown_where_they_are():
    scenes = [small_scene(group=group) for group in
              ('middv2', 'midd2006_third', 'midd2006_third', 'kitti', 'made')]
    assert anytime._shown(scenes) == (scenes[:2], [])
    assert anytime._shown(scenes[3:]) == (scenes[4:], ['the classic pairs: made instead'])
    assert anytime._shown(scenes[3:4])[0] == scenes[3:4]


def test_the_report_has_means_scenes_a_picture_and_correlations():
    report = anytime.run(request_for([small_scene()])(quick=True))
    assert_columns_have_names_of_their_own(report)
    assert [row[0] for row in report.tables[0].rows] == [start.name for start in STARTS]
    assert report.tables[-1].rows[0][0] == 'small/seed1'
    drawn = report.pictures.get('anytime.svg')
    assert drawn is None or b'realtime' in drawn


def test_a_curve_has_its_ends_and_points_that_are_a_fifth_apart():
    samples = [Trial(50.0, 0.1, float(time)) for time in (*range(1, 100), 99.5)]
    times = [sample.milliseconds for sample in apart(samples)]
    assert times[0] == 1 and times[-1] == 99.5
    assert all(after >= 1.2 * before for before, after in zip(times, times[1:-1]))
    assert len(times) < 25
