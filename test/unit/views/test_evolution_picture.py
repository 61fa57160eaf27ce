# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The still and the film of an evolution show what its snapshots hold."""
import os

from films import film
from fuzzy_stereo_ros.matching import MatcherConfig
from fuzzy_stereo_ros.pairs.image_files import read_image
from fuzzy_stereo_ros.synthetic.scenes import make_pair
from fuzzy_stereo_ros.views import evolution as evolution_view
from fuzzy_stereo_ros.views.evolution import (
    evolution_figure, EvolutionFilm, observe_generations, ORIGIN_COLOURS, RATES,
    Record, STAY)
from fuzzy_stereo_ros.views.pictures import PANEL_SUFFIXES, write_figure
import numpy as np
import pytest


def evolution(profile='realtime', with_truth=True, shape=(40, 60), **changes):
    """Return the course and the snapshots of an evolution on a noisy pair."""
    pair = make_pair(*shape, 16, noise=4.0, colour=True)
    config = MatcherConfig.from_profile(profile, **{
        'disparities': 16, 'generations': 2, 'reference': 'left', **changes})
    course, told = Record(config, pair.truth if with_truth else None), []

    def tell(snapshot):
        course.add(snapshot)
        told.append(snapshot)
    observe_generations(config, pair.left, pair.right, tell)
    return course, told


def pixels_of(picture):
    """Return how many pixels of a BGR picture have the colour of each origin."""
    wanted = [[int(colour[at:at + 2], 16) for at in (5, 3, 1)]
              for _, colour in sorted(ORIGIN_COLOURS.items())]
    return np.array([(picture == colour).all(axis=2).sum() for colour in wanted])


def check_origins(picture, snapshots):
    """Check that each colour covers the share of cells with that origin, but for the legend."""
    origins = np.stack([snapshot.origin for snapshot in snapshots])
    cells = np.bincount(origins.ravel(), minlength=len(ORIGIN_COLOURS))
    pixels = pixels_of(picture)
    np.testing.assert_allclose(pixels / pixels.sum(), cells / cells.sum(), atol=0.04)
    return np.count_nonzero(cells)


@pytest.mark.parametrize('profile, with_truth, origins', [
    pytest.param('paper', True, 3, marks=pytest.mark.slow), ('quality', False, 2)])
def test_the_still_shows_where_genes_come_from(tmp_path, profile, with_truth, origins):
    course, told = evolution(profile, with_truth)
    write_figure(tmp_path / 'still.png', evolution_figure(course))
    assert os.listdir(tmp_path) == ['still.png']
    picture = read_image(tmp_path / 'still.png')
    assert check_origins(picture, told[1:]) == origins


def test_an_evolution_of_no_generation_is_drawn_in_every_format(tmp_path):
    figure = evolution_figure(evolution(generations=0)[0])
    for suffix in PANEL_SUFFIXES:
        write_figure(tmp_path / f'still{suffix}', figure)
        assert (tmp_path / f'still{suffix}').stat().st_size > 10_000


@pytest.mark.parametrize('profile, changes, title', [
    ('paper', {}, 'fitness (uniform reading)'),
    ('paper', {'reading': 'literal'}, 'fitness (Eq. 3 as printed)'),
    ('realtime', {}, 'fitness (1 is perfect)')])
def test_curves_and_possibilities_fill_their_scales_and_the_reading_is_named(
        profile, changes, title):
    course, told = evolution(profile, shape=(40, 60), **changes)
    axes = evolution_figure(course).axes
    (place,) = (each for each in axes if each.get_title() == title)
    maps = [each.images[0] for each in axes if each.get_title().startswith('its possibility')]
    (scale,) = {one.get_clim() for one in maps}
    most = max(np.percentile(one.get_array().data, 95) for one in maps)
    assert scale[0] == 0 and most <= scale[1] <= max(most + 0.05, 0.05)
    for line, name in zip(place.lines, ('best', 'mean', 'worst'), strict=True):
        assert line.get_label() == name
        np.testing.assert_allclose(line.get_ydata(), [
            getattr(snapshot.fitness, {'best': 'max', 'worst': 'min'}.get(name, name))()
            for snapshot in told], rtol=1e-9)


# ---- the film ----


@pytest.fixture(autouse=True)
def small_film(monkeypatch):
    """Let frames be drawn in a quarter of the pixels, which takes less time."""
    monkeypatch.setattr(evolution_view, 'DOTS', (50, 200))


def test_the_animation_has_a_frame_for_each_generation_and_repeats_the_last(
        tmp_path, monkeypatch):
    drawn, draw = [], EvolutionFilm.picture

    def keep(film, snapshot):
        drawn.append(draw(film, snapshot))
        return drawn[-1]

    monkeypatch.setattr(EvolutionFilm, 'picture', keep)
    path, pair = tmp_path / 'film.avi', make_pair(40, 60, 16, noise=4.0)
    config = MatcherConfig.from_profile('paper', disparities=16, generations=3, reference='left')
    course = Record(config, pair.truth)
    animation = EvolutionFilm(path, course)
    observe_generations(config, pair.left, pair.right,
                        lambda snapshot: (course.add(snapshot), animation.add(snapshot)))
    animation.close()
    frames, rate = film(path)
    assert rate == RATES[0] and len(drawn) == 4 and len(frames) == 4 + STAY * RATES[0]
    for at, frame in enumerate(frames):
        near = [abs(frame.astype(int) - other).mean() for other in drawn]
        assert np.argmin(near) == min(at, 3) and min(near) < 10


def test_a_long_evolution_is_shown_faster(tmp_path):
    film = EvolutionFilm(tmp_path / 'film.mp4', Record(
        MatcherConfig(generations=55)))
    assert film.rate == 6
    film = EvolutionFilm(tmp_path / 'film.mp4', Record(
        MatcherConfig(), frames=5000))
    assert film.rate == RATES[1]
    film.close()
    assert os.listdir(tmp_path) == []
