# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The film at the top of the README."""
from pathlib import Path

from bench.film import FRAMES
import pytest

Image = pytest.importorskip('PIL.Image', reason='Pillow comes with matplotlib')
DOCS = Path(__file__).parents[2] / 'docs'


def test_the_film_of_the_readme_has_all_frames_in_at_most_a_megabyte():
    path = DOCS / 'evolution.webp'
    assert path.stat().st_size <= 1_000_000
    with Image.open(path) as film:
        assert film.n_frames == FRAMES
