# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""`fuzzy-stereo evolve` tells and draws what happens."""
import os

from command_output import printed
from fuzzy_stereo_ros.commands import evolve
from fuzzy_stereo_ros.commands.command_line import main
from fuzzy_stereo_ros.evaluation.scores import score
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.pairs.image_files import read_image
from fuzzy_stereo_ros.parameters.options import option_name
from fuzzy_stereo_ros.views import evolution
from fuzzy_stereo_ros.views.evolution import EvolutionFilm, RATES, STAY
from made_scenes import film
import numpy as np
import pytest

DISPARITIES = 16


@pytest.fixture(autouse=True)
def here(pair_folder, monkeypatch):
    """Work in a folder with a pair, its truth, and files that are in the way; draw little."""
    monkeypatch.setattr(evolution, 'DOTS', (50, 200))
    for name in ('there.png', 'there.avi'):
        (pair_folder / name).write_text('the one before')


def words_for(*more, **changes):
    options = {'disparities': DISPARITIES, **changes}
    return ['evolve', 'left.png', 'right.png', *more, *(
        word for name, value in options.items() if value is not None
        for word in (option_name(name), str(value)))]


def test_json_holds_every_generation_and_how_good_the_result_is(pair, capsys):
    figures = printed(capsys, *words_for(
        '--json', '--fill', profile='paper', population=8, generations=3,
        ground_truth='truth.pfm', mask='visible.png'))
    match = StereoMatcher(MatcherConfig.from_profile(
        'paper', disparities=DISPARITIES, population=8, generations=3,
        fill=True)).match(pair.left, pair.right)
    initial, *history = figures['generations']
    assert [row['number'] for row in history] == [1, 2, 3] and initial['number'] == 0
    for row, expected in zip(history, match.history, strict=True):
        assert row['best_fitness'] == expected.best_fitness
        assert row['mean_fitness'] == pytest.approx(expected.mean_fitness, rel=1e-12)
        assert row['worst_fitness'] <= row['mean_fitness']
        assert row['gains'] == expected.gains
        assert row['milliseconds'] > 0
    assert initial['best_fitness'] <= history[0]['best_fitness']
    expected = score(match.disparity, pair.truth, pair.visible)
    assert history[-1]['bad_1'] == expected.bad_dense[1.0]
    assert (figures['rows'], figures['columns'], figures['profile']) == (48, 80, 'paper')


def test_picture_and_video_are_written_and_printed_and_replace_others_where_that_is_said(
        monkeypatch, capsys):
    """The video has a frame for each generation and repeats the last."""
    drawn, write = [], EvolutionFilm.write

    def keep(film, picture):
        drawn.append(picture)
        write(film, picture)

    monkeypatch.setattr(EvolutionFilm, 'write', keep)
    assert main(words_for('--overwrite', profile='paper', population=3, generations=1,
                          picture='there.png', video='there.avi')) == 0
    assert capsys.readouterr().out.splitlines()[-2:] == [
        'there.png: written', 'there.avi: written']
    assert read_image('there.png').shape[1] > 450
    frames, rate = film('there.avi')
    assert rate == RATES[0] and len(drawn) == len(frames) == 2 + STAY * RATES[0]
    for at, frame in enumerate(frames):
        near = [abs(frame.astype(int) - other).mean() for other in drawn[:2]]
        assert np.argmin(near) == min(at, 1) and min(near) < 10
    assert not [name for name in os.listdir() if '.part' in name]


def test_an_interrupted_video_has_the_observed_generations(monkeypatch, capsys):
    observe_generations = evolve.observe_generations

    def interrupted(config, left, right, tell):
        def tell_two(snapshot):
            if snapshot.number == 2:
                raise KeyboardInterrupt
            tell(snapshot)
        return observe_generations(config, left, right, tell_two)

    monkeypatch.setattr(evolve, 'observe_generations', interrupted)
    assert main(words_for(profile='paper', population=3, generations=4, video='out.avi',
                          picture='out.png')) == 130
    assert 'a video ends with the last generation' in capsys.readouterr().err
    assert len(film('out.avi')[0]) == 2 + STAY * RATES[0]
    assert not os.path.exists('out.png')
