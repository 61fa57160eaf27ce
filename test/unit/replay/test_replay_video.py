# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""`fuzzy-stereo replay --video` shows every pair; the file is whole or not there."""
import os
import signal

from fuzzy_stereo_ros.commands.command_line import main
from fuzzy_stereo_ros.pairs.messages import read_image
from fuzzy_stereo_ros.replay.report import ProgressBar
from fuzzy_stereo_ros.views.video import HEAD
from made_bags import (
    BEGIN, COLUMNS, content, DISPARITIES, ROWS, scene, write_bag)
from made_scenes import film
import numpy as np
import pytest
from replayed import INTERRUPTED, replay, restamp

TIMES = 4       # that a narrow picture is repeated in a frame


def test_a_video_has_image_and_preview_of_each_pair_in_order(folder):
    pairs = scene(6, pan=4.0)
    write_bag(folder / 'panned', pairs=pairs)
    assert replay('panned', options=['--video', 'video.mp4']) == 0
    previews = [read_image(message) for _, _, message in content(folder / 'out', '/preview')]
    frames, rate = film(folder / 'video.mp4')
    assert rate == pytest.approx(30, rel=1e-3)
    assert len(frames) == 6
    for number, frame in enumerate(frames):
        assert frame.shape == (HEAD + TIMES * ROWS, 3 * TIMES * COLUMNS, 3)
        left, middle, _ = np.split(frame[HEAD::TIMES, ::TIMES].astype(int), 3, axis=1)
        for picture, others, limit in ((left[:, :, 0], [pair.left for pair in pairs], 12),
                                       (middle, previews, 20)):
            away = [abs(picture - other).mean() for other in others]
            assert np.argmin(away) == number and min(away) < limit


@pytest.mark.parametrize(('step', 'rate'), [(0, 10), (1, 240), (60 * 10**9, 0.1)])
def test_stamps_that_give_no_rate_for_a_video_give_the_nearest_one(folder, step, rate):
    write_bag(folder / 'odd', pairs=scene(2), change=lambda number, messages: restamp(
        messages, BEGIN + number * step))
    assert replay('odd', options=['--video', 'video.avi']) == 0
    assert film(folder / 'video.avi')[1] == pytest.approx(rate, rel=1e-3)


def test_an_interrupted_replay_has_the_video_of_what_was_matched(folder, capsys, monkeypatch):
    """A video alone needs no folder."""
    steps = []

    def step(bar):
        steps.append(None)
        if len(steps) % 4 == 0:
            os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr(ProgressBar, 'step', step)
    write_bag(folder / 'bag')
    assert replay('bag', options=['--video', 'video.avi']) == INTERRUPTED
    assert 'interrupted: out holds 4 pairs, up to 0.100 s into the bag; --resume continues' in \
        capsys.readouterr().err
    assert len(film(folder / 'video.avi')[0]) == 4
    assert main(['replay', 'bag', '--format', 'none', '--video', 'alone.avi', '--disparities',
                 str(DISPARITIES)]) == INTERRUPTED
    told = capsys.readouterr()
    assert 'alone.avi: 4 pairs matched' in told.out
    assert told.err.endswith(
        'interrupted: 4 pairs were written to alone.avi, up to 0.100 s into the bag\n')
    assert {path.name for path in folder.iterdir()} == {'bag', 'out', 'video.avi', 'alone.avi'}
    assert len(film(folder / 'alone.avi')[0]) == 4
