# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What is told of an evolution is what happened, and telling changes no bit of it."""
from dataclasses import replace

from command_output import printed, rejection
import cv2
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.matching.paper.fitness import Lineage
from fuzzy_stereo_ros.synthetic.scenes import make_pair
from fuzzy_stereo_ros.views import evolution as evolution_view
from fuzzy_stereo_ros.views.evolution import (
    Course, EvolutionFigure, FIRST, MUTATED, observe_frames, observe_generations,
    ORIGIN_COLOURS, origin_of_fittest_child, RATES, SECOND, STAY)
from made_scenes import bits, matched
from matplotlib.colors import to_rgb
import numpy as np
import pytest
from written_scenes import write_images

SHAPE = 60, 100
CONFIGS = {
    'paper': MatcherConfig.from_profile(
        'paper', disparities=24, population=12, generations=4, reference='right'),
    'realtime': MatcherConfig(disparities=24, min_disparity=-3),
    'quality': MatcherConfig.from_profile('quality', disparities=24, generations=3),
    'quality, right': MatcherConfig.from_profile('quality', disparities=24, reference='right')}


@pytest.fixture(scope='module')
def pair():
    return make_pair(*SHAPE, 24, seed=2, noise=4.0)


@pytest.fixture(autouse=True)
def small_film(monkeypatch):
    """Let frames be drawn in a quarter of the pixels, which takes less time."""
    monkeypatch.setattr(evolution_view, 'DOTS', (50, 200))


def watched(config, pair, truth=None):
    """Return the Match, the Snapshots and the Course of the evolution on a pair."""
    course, told = Course(config, truth), []
    match = observe_generations(config, pair.left, pair.right, lambda snapshot: (
        course.add(snapshot), told.append(snapshot)))
    return match, told, course


@pytest.mark.parametrize('name', CONFIGS)
def test_being_watched_changes_no_bit_and_each_generation_has_a_snapshot(name, pair):
    """Watching takes time, and so it knows no deadline."""
    config = CONFIGS[name]
    matcher = StereoMatcher(replace(config, generations=0))
    matcher.match(pair.left, pair.right)
    initial, alone = matcher.algorithm.population, matched(pair, config)
    match, told, _ = watched(replace(config, deadline_ms=1e-6), pair)
    assert bits(match) == bits(alone)
    rows, expected = ([replace(row, milliseconds=0.0) for row in one.history]
                      for one in (match, alone))
    assert rows == expected and len(rows) == config.generations
    assert [snapshot.number for snapshot in told] == list(range(config.generations + 1))
    for snapshot, row in zip(told[1:], match.history):
        assert snapshot.fitness.max() == row.best_fitness
        assert snapshot.fitness.mean() == pytest.approx(row.mean_fitness, rel=1e-12)
        assert snapshot.origin.dtype == np.uint8 and snapshot.origin.shape == SHAPE
    for snapshot in told:
        assert snapshot.best.dtype == snapshot.possibility.dtype == np.float32
        assert snapshot.possibility.shape == SHAPE
        assert 0 <= snapshot.possibility.min() <= snapshot.possibility.max() <= 1
    assert told[0].origin is None
    np.testing.assert_array_equal(told[0].fitness, initial.fitness)
    upright = (slice(None), slice(None, None, -1 if config.reference == 'right' else 1))
    np.testing.assert_array_equal(
        told[0].best[upright], initial.genes[initial.best].astype(int) + config.min_disparity)
    if config.algorithm == 'quality':   # where the fittest changes is what it took over
        taken = [after.best != before.best for before, after in zip(told, told[1:])]
        for changed, snapshot in zip(taken, told[1:]):
            np.testing.assert_array_equal(snapshot.origin, np.where(changed, MUTATED, FIRST))
        assert np.sum(taken) > 40


def test_the_origin_of_the_fittest_child_has_its_parents_and_mutations():
    former = np.random.default_rng(0).integers(0, 1000, (4, 7, 9), np.uint16)
    population = former.copy()
    population[2] = np.concatenate([former[3][:5], former[1][5:]])
    population[3] = np.concatenate([former[0][:2], former[2][2:]])
    population[2, 4:6, 3] = population[3, 4, 3] = 1001
    lineage = Lineage(np.array([2, 3]), np.array([[3, 1], [0, 2]]))
    for fitness, slot, line in (((9, 8, 7, 6), 2, 5), ((1, 1, 2, 3), 3, 2)):
        origin = origin_of_fittest_child(former, population, np.array(fitness), lineage)
        expected = np.full((7, 9), FIRST)
        expected[line:] = SECOND
        expected[population[slot] == 1001] = MUTATED
        np.testing.assert_array_equal(origin, expected)


@pytest.mark.parametrize('profile, changes, scale, origins', [
    ('paper', {'reading': 'literal'}, 'Eq. 3 as printed', 3), ('quality', {}, '1 is perfect', 2)])
def test_the_still_shows_fitness_possibilities_and_where_genes_come_from(
        profile, changes, scale, origins):
    """Each gene has the colour of its origin, curves and maps have their scales."""
    pair = make_pair(40, 60, 16, noise=4.0, colour=True)
    _, told, course = watched(MatcherConfig.from_profile(
        profile, disparities=16, generations=2, reference='left', **changes), pair,
        pair.truth if changes else None)
    figure = EvolutionFigure(course, course.shown).figure
    maps, genes = ([each.images[0] for each in figure.axes if each.get_title().startswith(words)]
                   for words in ('its possibility', 'genes'))
    (limits,) = {one.get_clim() for one in maps}
    most = max(np.percentile(one.get_array().data, 95) for one in maps)
    assert limits[0] == 0 and most <= limits[1] <= max(most + 0.05, 0.05)
    (fitness,) = (each for each in figure.axes if each.get_title() == f'fitness ({scale})')
    for line, name in zip(fitness.lines, ('best', 'mean', 'worst'), strict=True):
        assert line.get_label() == name
        np.testing.assert_allclose(line.get_ydata(), [
            getattr(snapshot.fitness, {'best': 'max', 'worst': 'min'}.get(name, name))()
            for snapshot in told], rtol=1e-9)
    colours = np.array([to_rgb(colour) for _, colour in sorted(ORIGIN_COLOURS.items())])
    for panel, snapshot in zip(genes, told[1:], strict=True):
        np.testing.assert_array_equal(
            panel.to_rgba(panel.get_array())[..., :3], colours[snapshot.origin])
    assert np.unique([snapshot.origin for snapshot in told[1:]]).size == origins


# ---- from frame to frame, as `evolve` shows it of two folders ----


PAIR = make_pair(96, 128, 24, 2, colour=True)
FRAMES = 2


@pytest.fixture
def folders(folder):
    """Return two folders of images in the working folder."""
    for number in range(FRAMES):
        write_images(folder, PAIR, f'left/{number:02}.png', f'right/{number:02}.png')
    return folder / 'left', folder / 'right'


def watched_frames(config, pairs):
    """Return the Snapshots and the Course of a sequence."""
    told, course = [], Course(config, PAIR.truth, PAIR.visible, len(pairs))
    observe_frames(config, pairs, lambda snapshot: (told.append(snapshot), course.add(snapshot)))
    return told, course


@pytest.mark.parametrize('reference', ['left', 'right'])
def test_of_paper_it_tells_which_genes_are_new_and_how_possible_the_best_is(reference):
    config = MatcherConfig.from_profile(
        'paper_live', disparities=24, threads=1, generations=2, reference=reference)
    frames, course = watched_frames(config, [(PAIR.left, PAIR.right)] * 3)
    matcher, before = StereoMatcher(config), None
    for frame in frames:
        matcher.match(PAIR.left, PAIR.right)
        population = matcher.algorithm.population
        best = population.genes[population.best].copy()
        upright = (slice(None), slice(None, None, -1 if reference == 'right' else 1))
        np.testing.assert_array_equal(frame.fitness, population.fitness)
        np.testing.assert_array_equal(
            frame.possibility, matcher.algorithm.possibility_of(best)[upright])
        assert (frame.origin is None) is (before is None)
        if before is not None:
            np.testing.assert_array_equal(
                frame.origin[upright], np.where(best != before, MUTATED, FIRST))
        assert frame.image is (PAIR.right if reference == 'right' else PAIR.left)
        before = best
    first, _, last = course.rows
    assert first['origins'] == {} and 1 > last['origins']['new'] > 0
    # The truth is of the left image.
    assert reference == 'right' or last['bad_1'] < first['bad_1']


@pytest.mark.parametrize('profile', ['realtime', 'fast'])
def test_genes_are_of_the_half_size_map_then_of_the_previous_best_until_a_cut(profile):
    """What is told of the result is that of a matcher that nobody watches."""
    other = make_pair(96, 128, 24, 7, colour=True)
    pairs = [(PAIR.left, PAIR.right)] * 2 + [(other.left, other.right)]
    config = MatcherConfig.from_profile(profile, disparities=24, threads=1)
    frames, course = watched_frames(config, pairs)
    matcher = StereoMatcher(config)
    for frame, row, pair in zip(frames, course.rows, pairs, strict=True):
        match, shares = matcher.match(*pair), row['origins']
        np.testing.assert_array_equal(frame.best, match.disparity)
        assert (row['warm'], row['gains']) == (match.warm, match.gains)
        assert sum(shares.values()) == pytest.approx(1)
        assert shares['previous best'] == np.mean(frame.origin == FIRST)
        assert shares['mutated by one'] == np.mean(frame.origin == MUTATED)
    assert [row['warm'] for row in course.rows] == [False, True, False]
    assert course.rows[1]['bad_1'] < course.rows[2]['bad_1']
    first, second, cut = (row['origins'] for row in course.rows)
    assert first['previous best'] == cut['previous best'] == 0
    assert min(first['half-size map'], second['previous best'], cut['half-size map']) > 0.5


def test_two_folders_are_a_sequence_of_frames(folders, tmp_path, capsys):
    pytest.importorskip('matplotlib')
    film = tmp_path / 'frames.avi'
    told = ['evolve', *folders, '--disparities', 24, '--profile', 'fast']
    assert f'{film}: written' in printed(capsys, *told, '--video', film)
    pictures = cv2.VideoCapture(str(film)).get(cv2.CAP_PROP_FRAME_COUNT)
    assert pictures == FRAMES + STAY * RATES[0]
    (folders[1] / '01.png').unlink()        # those of both are left
    found = printed(capsys, *told, '--json')
    assert [frame['number'] for frame in found['frames']] == [1]


def test_folders_without_equal_names_or_stamps_are_rejected(folders, capsys):
    for side, folder in enumerate(folders):
        for number, path in enumerate(sorted(folder.iterdir())):
            path.rename(folder / f'{1738133056 + 10 * number + side}.png')
    assert 'no images have equal stamps; give their files equal names' in rejection(
        capsys, 'evolve', *folders, '--disparities', '24')
