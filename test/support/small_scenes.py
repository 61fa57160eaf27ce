# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Scenes with ground truth that are matched in no time."""
from functools import partial

from bench.scoring import ScoredPair
from fuzzy_stereo_ros.evaluation.catalogue import Scene
from fuzzy_stereo_ros.evaluation.ground_truth import MIDDLEBURY
from fuzzy_stereo_ros.synthetic.scenes import make_pair

ROWS, COLUMNS, DISPARITIES = 40, 72, 16


def known(seed=1, size=(ROWS, COLUMNS, DISPARITIES), **options):
    """Return a `ScoredPair`; size: rows, columns, disparities."""
    return ScoredPair(*make_pair(*size, seed, **options))


def small_scene(seed=1, group='small', name=None, size=(ROWS, COLUMNS, DISPARITIES), **options):
    """Return a `Scene`, called after its seed unless it has a name."""
    return Scene(group, name or f'seed{seed}', MIDDLEBURY, size[2],
                 partial(known, seed, size, **options))
