# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Scenes with ground truth that are matched in no time, and requests of benchmarks for them."""
from functools import partial

from fuzzy_stereo_ros.benchmarks.request import Request
from fuzzy_stereo_ros.evaluation.catalogue import Scene
from fuzzy_stereo_ros.evaluation.ground_truth import GroundTruthPair, MIDDLEBURY
from fuzzy_stereo_ros.synthetic.scenes import make_pair

ROWS, COLUMNS, DISPARITIES = 40, 72, 16


def known(seed=1, size=(ROWS, COLUMNS, DISPARITIES), **options):
    """Return a `GroundTruthPair`; size: rows, columns, disparities."""
    return GroundTruthPair(*make_pair(*size, seed, **options))


def small_scene(seed=1, group='small', name=None, size=(ROWS, COLUMNS, DISPARITIES), **options):
    """Return a `Scene`, called after its seed unless it has a name."""
    return Scene(group, name or f'seed{seed}', MIDDLEBURY, size[2],
                 partial(known, seed, size, **options))


def request_for(scenes, sequences=None):
    """Return a class of requests for scenes, of which a group is missing, and for sequences."""
    class SmallRequest(Request):
        def scenes(self):
            return scenes, ['a group']

        def sequences(self, scenes):
            return super().sequences(scenes) if sequences is None else sequences

    return SmallRequest


def assert_columns_have_names_of_their_own(report):
    """Check that no two columns of a table of a `Report` are called alike, and rows are whole."""
    for table in report.tables:
        assert len(set(table.columns)) == len(table.columns)
        assert all(len(row) == len(table.columns) for row in table.rows)
