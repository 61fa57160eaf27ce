# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""`fuzzy-stereo replay --video` shows every pair; the file is whole or not there."""
import os
import signal

from fuzzy_stereo_ros.commands.command_line import main
from fuzzy_stereo_ros.pairs.messages import read_image
from fuzzy_stereo_ros.replay.report import ProgressBar
from fuzzy_stereo_ros.views.video import CODECS, HEAD
from made_bags import (
    BEGIN, COLUMNS, content, DISPARITIES, ROWS, scene, write_bag)
from made_scenes import film
import numpy as np
import pytest
from replayed import INTERRUPTED, replay, restamp

TIMES = 4       # that a narrow picture is repeated in a frame


@pytest.fixture
def folder(folder):
    """Work in a folder with a bag."""
    write_bag(folder / 'bag')
    return folder


def names_in(folder):
    return {path.name for path in folder.iterdir()}


def nearest(picture, pictures):
    """Return the number of the picture that is most like another, and how far it is, grey."""
    away = [abs(picture.astype(int) - other.astype(int)).mean() for other in pictures]
    return int(np.argmin(away)), min(away)


@pytest.mark.parametrize('suffix', CODECS)
def test_a_video_has_image_and_preview_of_each_pair_in_order(folder, suffix):
    pairs = scene(6, pan=4.0)
    write_bag(folder / 'panned', pairs=pairs)
    assert replay('panned', options=['--video', f'video{suffix}']) == 0
    previews = [read_image(message) for _, _, message in content(folder / 'out', '/preview')]
    frames, rate = film(folder / f'video{suffix}')
    assert rate == pytest.approx(30, rel=1e-3)
    assert len(frames) == 6
    for number, frame in enumerate(frames):
        assert frame.shape == (HEAD + TIMES * ROWS, 3 * TIMES * COLUMNS, 3)
        left, middle, _ = np.split(frame[HEAD::TIMES, ::TIMES], 3, axis=1)
        found, away = nearest(left[:, :, 0], [pair.left for pair in pairs])
        assert found == number and away < 12
        found, away = nearest(middle, previews)
        assert found == number and away < 20


@pytest.mark.parametrize(('step', 'rate'), [(0, 10), (1, 240), (60 * 10**9, 0.1)])
def test_stamps_that_give_no_rate_for_a_video_give_the_nearest_one(folder, step, rate):
    write_bag(folder / 'odd', pairs=scene(3), change=lambda number, messages: restamp(
        messages, BEGIN + number * step))
    assert replay('odd', options=['--video', 'video.avi']) == 0
    assert film(folder / 'video.avi')[1] == pytest.approx(rate, rel=1e-3)


def test_a_video_alone_is_enough_and_needs_no_folder(folder, capsys):
    assert main(['replay', 'bag', '--format', 'none', '--video', 'video.avi',
                 '--disparities', str(DISPARITIES)]) == 0
    assert 'video.avi: 6 pairs matched' in capsys.readouterr().out
    assert names_in(folder) == {'bag', 'video.avi'}
    assert len(film(folder / 'video.avi')[0]) == 6


def test_an_interrupted_replay_has_the_video_of_what_was_matched(folder, capsys, monkeypatch):
    steps = []

    def step(bar):
        steps.append(None)
        if len(steps) % 4 == 0:
            os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr(ProgressBar, 'step', step)
    assert replay('bag', options=['--video', 'video.avi']) == INTERRUPTED
    assert 'interrupted: out holds 4 pairs, up to 0.100 s into the bag; --resume continues' in \
        capsys.readouterr().err
    assert len(film(folder / 'video.avi')[0]) == 4
    assert replay('bag', options=['--video', 'alone.avi', '--format', 'none'],
                  output='unused') == INTERRUPTED
    assert capsys.readouterr().err.endswith(
        'interrupted: 4 pairs were written to alone.avi, up to 0.100 s into the bag\n')
    assert len(film(folder / 'alone.avi')[0]) == 4
