# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""An evolution from frame to frame, as `evolve` shows it of two folders."""
import json

import cv2
from fuzzy_stereo_ros.commands.command_line import main
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.pairs.image_files import write_image
from fuzzy_stereo_ros.synthetic.scenes import make_pair
from fuzzy_stereo_ros.views import evolution
from fuzzy_stereo_ros.views.evolution import (
    Course, FIRST, MUTATED, observe_frames, RATES, STAY)
import numpy as np
import pytest
from rejected import rejection

PAIR = make_pair(96, 128, 24, 2, colour=True)
FRAMES = 3


@pytest.fixture
def folders(tmp_path, monkeypatch):
    """Return two folders of images in the working folder; films have a quarter of the pixels."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(evolution, 'DOTS', (50, 200))
    for side in ('left', 'right'):
        (tmp_path / side).mkdir()
        for number in range(FRAMES):
            write_image(tmp_path / side / f'{number:02}.png', getattr(PAIR, side))
    return tmp_path / 'left', tmp_path / 'right'


def watched(config, pairs, truth=None, mask=None):
    """Return the Snapshots and the Course of a sequence."""
    told, course = [], Course(config, truth, mask, len(pairs))
    observe_frames(config, pairs, lambda snapshot: (told.append(snapshot), course.add(snapshot)))
    return told, course


@pytest.mark.parametrize('reference', ['left', 'right'])
def test_of_paper_it_tells_which_genes_are_new_and_how_possible_the_best_is(reference):
    config = MatcherConfig.from_profile(
        'paper_live', disparities=24, threads=1, generations=2, reference=reference)
    frames, course = watched(config, [(PAIR.left, PAIR.right)] * 3, PAIR.truth, PAIR.visible)
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
    frames, course = watched(config, pairs, PAIR.truth, PAIR.visible)
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
    told = ['evolve', *map(str, folders), '--disparities', '24', '--profile', 'fast']
    assert main([*told, '--video', str(film)]) == 0
    assert f'{film}: written' in capsys.readouterr().out
    pictures = cv2.VideoCapture(str(film)).get(cv2.CAP_PROP_FRAME_COUNT)
    assert pictures == FRAMES + STAY * RATES[0]
    (folders[1] / '01.png').unlink()        # those of both are left
    assert main([*told, '--json']) == 0
    found = json.loads(capsys.readouterr().out)
    assert [frame['number'] for frame in found['frames']] == [1, 2]


def test_folders_without_equal_names_or_stamps_are_rejected(folders, capsys):
    for side, folder in enumerate(folders):
        for number, path in enumerate(sorted(folder.iterdir())):
            path.rename(folder / f'{1738133056 + 10 * number + side}.png')
    assert 'no images have equal stamps; give their files equal names' in rejection(
        capsys, 'evolve', *folders, '--disparities', '24')
