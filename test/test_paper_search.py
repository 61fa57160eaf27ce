# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The paper's search as a whole."""
from fuzzy_stereo_ros.matching.config import MatcherConfig
from fuzzy_stereo_ros.matching.evolution import Budget, evolve
from fuzzy_stereo_ros.matching.matcher import StereoMatcher
from fuzzy_stereo_ros.matching.operators import elite_size, fittest_first
from fuzzy_stereo_ros.matching.paper_search import PaperSearch
import numpy as np
import pytest
import reference

ROWS, COLUMNS, DISPARITIES = 21, 33, 6


def pair(seed=0, shape=(ROWS, COLUMNS), shift=3):
    """Return a textured wall, seen with one disparity."""
    generator = np.random.default_rng(seed)
    wide = generator.integers(0, 256, (shape[0], shape[1] + shift)).astype(np.uint8)
    return (np.ascontiguousarray(wide[:, :shape[1]]), np.ascontiguousarray(wide[:, shift:]))


def search_for(images=None, seed_words=(0, 0), **changes):
    settings = {'disparities': DISPARITIES, 'population': 10, 'generations': 8, 'threads': 1}
    config = MatcherConfig.from_profile('paper', **{**settings, **changes})
    left, right = images or pair()
    search = PaperSearch(config, *left.shape[:2])
    search.start(left, right, None, seed_words)
    return search, config


def evolved(images=None, seed_words=(0, 0), **changes):
    search, config = search_for(images, seed_words, **changes)
    return search, evolve(search, Budget(config.generations, 0, 0))


def outcome(search, history):
    rows = [(row.best_fitness, row.mean_fitness, row.diversity, row.gains) for row in history]
    return search.population.tobytes(), search.fitness.tobytes(), rows


def test_the_same_pair_and_seed_give_the_same_bits():
    assert outcome(*evolved()) == outcome(*evolved())


@pytest.mark.parametrize('survival', ['rank', 'sigmoid'])
def test_the_number_of_threads_changes_no_bit(survival):
    one = outcome(*evolved(threads=1, survival=survival))
    assert one == outcome(*evolved(threads=2, survival=survival))
    assert one == outcome(*evolved(threads=13, survival=survival))


def test_another_seed_or_frame_gives_another_evolution():
    outcomes = [outcome(*evolved(seed_words=words)) for words in ((0, 0), (1, 0), (0, 1))]
    assert len({population for population, _, _ in outcomes}) == 3


def test_another_seed_or_frame_starts_from_another_population():
    populations = {search_for(seed_words=words)[0].population.tobytes()
                   for words in ((0, 0), (1, 0), (0, 1))}
    assert len(populations) == 3


def test_a_second_pair_is_searched_as_by_a_new_search():
    search, _ = evolved(patience=1)
    other = pair(seed=5)
    search.start(*other, None, (0, 7))
    assert not search.settled
    again = outcome(search, evolve(search, Budget(8, 0, 0)))
    assert again == outcome(*evolved(other, (0, 7), patience=1))


@pytest.mark.parametrize('shape, disparities, min_disparity', [
    ((9, 14), 5, 0), ((1, 12), 4, -2), ((12, 1), 3, 0), ((8, 6), 20, -3), ((5, 7), 3, 30)])
def test_every_fitness_of_every_generation_is_eq_3(shape, disparities, min_disparity):
    """Also for the elite, which is not evaluated again, and beside the crossover line."""
    left, right = pair(shape=shape)
    search, _ = search_for((left, right), disparities=disparities, min_disparity=min_disparity,
                           population=6, neighbourhood=3)
    volume = np.rint(255 * reference.possibility_volume(
        left, right, disparities, min_disparity, 54.0)).astype(np.int64)
    norms = reference.sobel_norm(left), reference.sobel_norm(right)
    for number in range(1, 4):
        search.generation(number)
        for chromosome, fitness in zip(search.population, search.fitness):
            assert chromosome.max() < disparities
            assert fitness * 255 == pytest.approx(
                reference.fitness(volume, chromosome, *norms, min_disparity, 3), abs=1e-6)


def test_the_initial_population_is_random_and_diverse():
    search, _ = search_for()
    assert not np.array_equal(search.population[0], search.population[1])
    counts = np.bincount(search.population.ravel(), minlength=DISPARITIES)
    expected = search.population.size / DISPARITIES
    assert counts.size == DISPARITIES
    assert np.abs(counts - expected).max() < 5 * np.sqrt(expected)


def test_the_elite_lives_on_unchanged_and_the_others_are_replaced():
    search, config = search_for()
    former, fitness = search.population.copy(), search.fitness.copy()
    search.generation(1)
    elite = fittest_first(fitness)[:elite_size(config.population, config.elite)]
    assert elite.size == 4
    for slot, old in enumerate(elite):
        np.testing.assert_array_equal(search.population[slot], former[old])
        assert search.fitness[slot] == fitness[old]
    for child in search.population[elite.size:]:
        assert not any(np.array_equal(child, old) for old in former)


def origins_of(child, former):
    """Return, row by row, which former chromosome a child has it from."""
    origins = [[index for index, parent in enumerate(former) if np.array_equal(row, parent[line])]
               for line, row in enumerate(child)]
    assert all(len(origin) == 1 for origin in origins)
    return [origin[0] for origin in origins]


@pytest.mark.parametrize('number', [1, 2])
def test_the_kinship_tells_where_every_row_comes_from(number):
    search, _ = search_for(mutation_rate=0.0)
    assert search.kinship is None
    for generation in range(1, number + 1):
        former = search.population.copy()
        search.generation(generation)
    elite, parents, lines = search.kinship
    np.testing.assert_array_equal(search.population[:elite.size], former[elite])
    assert elite.size == 4
    for child in range(elite.size, len(former)):
        first, second = former[parents[child]]
        np.testing.assert_array_equal(search.population[child, :lines[child]],
                                      first[:lines[child]])
        np.testing.assert_array_equal(search.population[child, lines[child]:],
                                      second[lines[child]:])
    search.start(*pair(seed=5), None, (0, 1))
    assert search.kinship is None


def test_a_generation_that_is_not_made_leaves_the_kinship_of_the_living():
    search, _ = search_for()
    search.generation(1)
    kinship = search.kinship
    search.generation(2, lambda: False)
    assert search.kinship is kinship


def children_without_mutation(number=1, seed_words=(0, 0)):
    """Return the origins of each child of one generation."""
    search, _ = search_for(seed_words=seed_words, mutation_rate=0.0)
    former = search.population.copy()
    search.generation(number)
    return [origins_of(child, former) for child in search.population[4:]]


def test_children_are_cut_from_two_parents_where_nothing_mutates():
    cuts = [sum(above != below for above, below in zip(origins, origins[1:]))
            for origins in children_without_mutation()]
    assert set(cuts) <= {0, 1}
    assert sum(cuts) > 0


def test_couples_and_lines_change_with_seed_frame_and_generation():
    lines = [[origins.count(origins[0]) for origins in children]
             for children in (children_without_mutation(1), children_without_mutation(2),
                              children_without_mutation(1, (1, 0)),
                              children_without_mutation(1, (0, 1)))]
    assert len({tuple(of_generation) for of_generation in lines}) == 4


def test_mutants_differ_from_each_other_and_from_those_of_another_generation():
    """On one row, with N so wide, each child is its parent with one patch."""
    genes = []
    for number in range(1, 7):
        search, _ = search_for(pair(shape=(1, COLUMNS)), neighbourhood=31, mutation_rate=1.0)
        search.generation(number)
        genes.append([np.bincount(child[0]).argmax() for child in search.population[4:]])
    assert all(len(set(of_generation)) > 1 for of_generation in genes)
    assert len({tuple(of_generation) for of_generation in genes}) == 6


def test_gains_without_mutation_are_all_of_the_crossover():
    history = evolved(mutation_rate=0.0)[1]
    assert sum(row.gains['crossover'] for row in history) > 0
    assert all(row.gains['mutation'] == 0 for row in history)


def test_gains_add_up_to_the_rise_of_the_best():
    search, config = search_for()
    best = search.fitness.max()
    for row in evolve(search, Budget(config.generations, 0, 0)):
        assert sum(row.gains.values()) == pytest.approx(row.best_fitness - best, abs=1e-3)
        best = row.best_fitness


def test_the_best_never_declines_and_rises_in_the_end():
    search, config = search_for(generations=30)
    best = [search.fitness.max()]
    best += [row.best_fitness for row in evolve(search, Budget(config.generations, 0, 0))]
    assert np.all(np.diff(best) >= 0)
    assert best[-1] > 1.2 * best[0]


@pytest.mark.parametrize('elite', [0.0, 1.0])
def test_the_best_lives_on_whatever_the_elite(elite):
    search, history = evolved(elite=elite)
    best = [row.best_fitness for row in history]
    assert np.all(np.diff(best) >= 0)
    assert (best[-1] == best[0]) == (elite == 1.0)


def test_without_gain_for_patience_generations_the_search_settles():
    history = evolved(elite=1.0, patience=3, generations=50)[1]
    assert len(history) == 3
    assert len(evolved(elite=1.0, patience=0, generations=50)[1]) == 50


def test_patience_starts_anew_with_each_fitter_best():
    history = evolved(generations=200)[1]
    waited, expected = 0, None
    for row in history:
        waited = 0 if any(row.gains.values()) else waited + 1
        if waited == 3:
            expected = row.number
            break
    useless = sum(not any(row.gains.values()) for row in history[:expected])
    assert useless > 3, 'the case is too easy: choose another seed'
    assert len(evolved(generations=200, patience=3)[1]) == expected


def test_the_best_chromosome_is_a_copy_of_the_fittest():
    search, _ = evolved()
    best = search.best_chromosome()
    assert best.dtype == np.uint16
    np.testing.assert_array_equal(best, search.population[search.fitness.argmax()])
    best[:] = 0
    assert search.best_chromosome().any()


def test_the_possibility_of_a_chromosome_is_eq_2_to_half_a_255th():
    left, right = pair()
    search, _ = evolved((left, right))
    chromosome = search.best_chromosome()
    found = search.possibility_of(chromosome)
    exact = reference.chosen_possibility(
        reference.possibility_volume(left, right, DISPARITIES, 0, 54.0), chromosome)
    assert found.dtype == np.float32
    assert np.abs(found - exact).max() <= 0.5001 / 255


def finished(search, stamp=None):
    disparity, confidence = np.full((2, ROWS, COLUMNS), -7, np.float32)
    assert search.finish(stamp, 0, disparity, confidence) is None
    return disparity, confidence


def test_the_search_ends_with_its_best_in_pixels_and_its_possibility():
    search, _ = evolved(min_disparity=-2)
    disparity, confidence = finished(search)
    np.testing.assert_array_equal(disparity, search.best_chromosome().astype(float) - 2)
    np.testing.assert_array_equal(confidence, search.possibility_of(search.best_chromosome()))
    assert list(search.times) == ['possibility', 'seeds', 'generations', 'refinement']


def test_pixels_less_sure_than_the_threshold_are_invalid_unless_filled():
    search, _ = evolved(confidence_threshold=0.6)
    disparity, confidence = finished(search)
    assert 0 < np.isnan(disparity).sum() < disparity.size
    np.testing.assert_array_equal(np.isnan(disparity), confidence < np.float32(0.6))
    search, _ = evolved(confidence_threshold=0.6, fill=True)
    assert not np.isnan(finished(search)[0]).any()


@pytest.mark.parametrize('reference_image', ['left', 'right'])
def test_the_matcher_runs_it_on_either_reference(reference_image):
    """The right reference is the mirrored and exchanged pair."""
    left, right = pair()
    config = MatcherConfig.from_profile(
        'paper', disparities=DISPARITIES, population=10, generations=8, threads=1,
        reference=reference_image)
    match = StereoMatcher(config).match(left, right, stamp=5)
    mirror = slice(None, None, -1 if reference_image == 'right' else 1)
    images = (left, right) if reference_image == 'left' else (right[:, ::-1], left[:, ::-1])
    search, history = evolved([np.ascontiguousarray(image) for image in images], (0, 5))
    np.testing.assert_array_equal(match.disparity[:, mirror], search.best_chromosome())
    assert not match.warm
    assert [row.best_fitness for row in match.history] == [row.best_fitness for row in history]


def test_colour_and_16_bits_are_matched_as_their_grey_levels():
    left, right = pair()
    grey = outcome(*evolved((left, right)))
    colour = [np.repeat(image[:, :, np.newaxis], 3, axis=2) for image in (left, right)]
    assert outcome(*evolved(colour)) == grey
    deep = [image.astype(np.uint16) << 4 for image in (left, right)]
    assert outcome(*evolved(deep)) == grey


def test_the_pair_given_is_not_changed():
    left, right = pair()
    before = left.copy(), right.copy()
    evolved((left, right))
    np.testing.assert_array_equal(left, before[0])
    np.testing.assert_array_equal(right, before[1])
