# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The truth beside the result of `quality`: errors and fitness are those of the maps named."""
from fuzzy_stereo_ros.benchmarks import truth
from fuzzy_stereo_ros.evaluation.ground_truth import bad_percent
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
import numpy as np
import pytest
from small_scenes import request_for, small_scene

SCENE = small_scene(1, 'made', 'one', (60, 100, 24), noise=3.0)
KNOWN = SCENE.read()


def test_the_report_compares_the_result_with_where_evolution_from_the_truth_ends():
    report = truth.run(request_for([SCENE])())
    (table,), (row, mean) = report.tables, report.tables[0].rows
    assert len(row) == len(mean) == len(table.columns)
    path, error, from_truth, distance, result_fitness, truth_fitness, end_fitness = row
    assert path == 'made/one' and report.skipped == ['a group']
    matcher = StereoMatcher(MatcherConfig.from_profile('quality', disparities=24, threads=1))
    matcher.match(KNOWN.left, KNOWN.right)
    fittest = matcher.algorithm.fittest()
    assert error == bad_percent(fittest, KNOWN, 1.0) >= from_truth
    assert distance == error - from_truth
    assert result_fitness == matcher.algorithm.fitness_of(fittest)
    assert truth_fitness == matcher.algorithm.fitness_of(np.float32(KNOWN.truth))
    assert end_fitness > 0
    assert mean[1:4] == pytest.approx(row[1:4])
