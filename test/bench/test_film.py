# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The film at the top of the README."""
from pathlib import Path

from bench.film import FRAMES, MILLISECONDS, STAY, write_film
import cv2
import numpy as np
import pytest

Image = pytest.importorskip('PIL.Image', reason='Pillow comes with matplotlib')
DOCS = Path(__file__).parents[2] / 'docs'


def test_the_film_of_the_readme_has_all_frames_in_at_most_a_megabyte():
    path = DOCS / 'evolution.webp'
    assert path.stat().st_size <= 1_000_000
    with Image.open(path) as film:
        assert film.n_frames == FRAMES


def test_a_film_shows_each_picture_and_the_last_one_longer(tmp_path):
    pictures = [np.full((32, 48, 3), colour, np.uint8) for colour in (0, (200, 90, 30), 255)]
    write_film(tmp_path / 'film.webp', pictures)
    with Image.open(tmp_path / 'film.webp') as film:
        assert film.n_frames == 3
        for number, (picture, shown) in enumerate(zip(pictures, (MILLISECONDS,) * 2 + (STAY,))):
            film.seek(number)
            found = cv2.cvtColor(np.array(film.convert('RGB')), cv2.COLOR_RGB2BGR)
            assert abs(found.astype(int) - picture).max() <= 8
            assert film.info['duration'] == shown
