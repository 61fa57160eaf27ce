# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Anytime: each start begins with the population it names, and its course only gets fitter."""
from fuzzy_stereo_ros.benchmarks import anytime, anytime_picture
from fuzzy_stereo_ros.benchmarks.anytime import Stand, stand_at
from fuzzy_stereo_ros.benchmarks.courses import course_of, DataSeeds, RandomSeeds, STARTS
from fuzzy_stereo_ros.benchmarks.datasets import Scene
from fuzzy_stereo_ros.benchmarks.measured_search import MeasuredSearch
from fuzzy_stereo_ros.benchmarks.request import Request
from fuzzy_stereo_ros.comparing.known_pairs import KnownPair, MIDDLEBURY
from fuzzy_stereo_ros.made_scenes import made_pair
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
import numpy as np
import pytest

ROWS, COLUMNS, DISPARITIES = 40, 72, 16
MADE = made_pair(ROWS, COLUMNS, DISPARITIES, 1)
KNOWN = KnownPair(MADE.left, MADE.right, MADE.truth, MADE.visible)


def small_scene(group='small'):
    return Scene(group, 'one', MIDDLEBURY, DISPARITIES, lambda: KNOWN)


def searched(search, generations=0):
    matcher = StereoMatcher(MatcherConfig(
        disparities=DISPARITIES, threads=1, population=6, generations=generations), search)
    matcher.match(KNOWN.left, KNOWN.right)
    return matcher.search


def test_random_seeds_use_all_genes_alike_and_none_twice():
    population = searched(RandomSeeds).population
    assert len({member.tobytes() for member in population}) == 6
    counts = np.bincount(population.ravel(), minlength=DISPARITIES)
    assert counts.size == DISPARITIES
    assert counts.std() < 0.1 * counts.mean()


def test_seeds_stand_in_order_of_their_fitness():
    for search in (searched(RandomSeeds), searched(DataSeeds)):
        assert (np.diff(search.fitness) <= 0).all()
        np.testing.assert_array_equal(
            search.fitness, [search.fitness_of(member) for member in search.population])


def test_a_guess_from_the_data_is_more_possible_than_chance():
    def cost(search):
        return np.mean(search._fitness.costs_of(search._crew, search.population[0]))
    assert cost(searched(DataSeeds)) < 0.75 * cost(searched(RandomSeeds))


def test_the_first_generation_crosses_the_fittest_with_all_others():
    seeds = searched(DataSeeds)
    child = searched(DataSeeds, 1)
    assert child.fitness_of(child.population[0]) > seeds.fitness[0]
    assert child.fitness[0] == pytest.approx(child.fitness_of(child.population[0]))


@pytest.mark.parametrize('start', STARTS, ids=lambda start: start.name)
def test_a_course_never_gets_less_fit_and_ends_when_time_is_up(start):
    notes = course_of(start, DISPARITIES, [(KNOWN.left, KNOWN.right)] * 2, 60)
    times = [milliseconds for milliseconds, _ in notes]
    assert times == sorted(times)
    assert times[-1] < 10_000
    search = searched(MeasuredSearch)
    fitness = [search.fitness_of(genes.astype(np.uint8)) for _, genes in notes]
    if 'operators and fitness' not in start.name and not start.warm:
        assert (np.diff(fitness) > -1e-9).all()


def test_what_was_had_at_a_time_is_the_last_that_was_reached_before():
    stands = [Stand(3.0, 0.1, 50.0), Stand(8.0, 0.2, 40.0)]
    assert stand_at(stands, 2) is None
    assert stand_at(stands, 5) is stands[0]
    assert stand_at(stands, 8) is stands[1]


def test_the_classic_pairs_and_one_of_2006_are_shown_where_they_are():
    scenes = [small_scene(group) for group in
              ('middv2', 'midd2006_third', 'midd2006_third', 'kitti', 'made')]
    assert anytime._shown(scenes) == (scenes[:2], [])
    assert anytime._shown(scenes[3:]) == (scenes[4:], ['the classic pairs: made instead'])
    assert anytime._shown(scenes[3:4])[0] == scenes[3:4]


def test_the_report_has_means_scenes_a_picture_and_correlations():
    class SmallRequest(Request):
        def scenes(self):
            return [small_scene()], []

    report = anytime.run(SmallRequest(quick=True))
    for table in report.tables:
        assert len(set(table.columns)) == len(table.columns)
        assert all(len(row) == len(table.columns) for row in table.rows)
    assert [row[0] for row in report.tables[0].rows] == [start.name for start in STARTS]
    assert report.tables[-1].rows[0][0] == 'small/one'
    assert report.tables[-1].rows[0][2] > 0.5
    drawn = report.pictures.get('anytime.svg')
    assert drawn is None or b'scanline seeds' in drawn


def test_a_curve_has_its_ends_and_points_that_are_a_fifth_apart():
    stands = [Stand(float(time), 0.1, 50.0) for time in (*range(1, 100), 99.5)]
    times = [stand.milliseconds for stand in anytime_picture.apart(stands)]
    assert times[0] == 1 and times[-1] == 99.5
    assert all(after >= 1.2 * before for before, after in zip(times, times[1:-1]))
    assert len(times) < 25
