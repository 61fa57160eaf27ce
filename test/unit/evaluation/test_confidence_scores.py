# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a confidence is worth: sparsification and reliability; tables and progress in text."""
import io

from fuzzy_stereo_ros.evaluation.report import markdown, Report, Table
from fuzzy_stereo_ros.evaluation.scores import (
    BINS, left_right_sureness, reliability, sparsification)
from fuzzy_stereo_ros.progress import follow
import numpy as np
import pytest
from small_scenes import small_scene

NAN = np.nan


def test_the_sparsification_of_a_perfect_order_falls_at_once():
    wrong = np.array([True, False, False, False, False])
    assert sparsification(wrong, np.array([0, 4, 3, 2, 1.0])) == (
        pytest.approx(20 / 5), 0, pytest.approx(20))


def test_pixels_that_are_equally_sure_count_as_mixed():
    wrong = np.arange(10) % 2 == 0
    for order in (wrong, wrong[::-1], np.sort(wrong)):
        assert sparsification(order, np.ones(10)) == pytest.approx((50, 50, 50))


def test_what_has_no_confidence_is_dropped_first():
    wrong = np.array([False, True])
    assert sparsification(wrong, np.array([0, NAN])).area == pytest.approx(25)


def test_pixels_with_confidence_are_counted_by_its_range():
    confidence = np.array([0, 0, 0.1, 0.55, 0.9, 0.92, 0.93, 1])
    wrong = np.array([True, False, True, False, False, True, False, False])
    number, right = reliability(wrong, confidence)
    assert len(number) == len(BINS) - 1
    assert number.tolist() == [1, 1, 0, 0, 0, 3, 1]
    assert right.tolist() == [0, 1, 0, 0, 0, 2, 1]


def test_maps_that_meet_are_sure_and_maps_that_do_not_are_unsure():
    left = np.array([[0, 1, 2, 2, 5]], np.float32)
    right = np.array([[2, 4, 0, 0, 0]], np.float32)
    np.testing.assert_array_equal(left_right_sureness(left, right), [[-2, -1, 0, -2, NAN]])


def report_of(value):
    return Report('accuracy', 'Accuracy', {'machine': 'one'}, [
        Table('Errors', ('', 'ours'), [('a scene', value), ('another', None)], 'Note.')], ['x'])


def test_a_table_has_columns_of_equal_width_and_a_dash_where_nothing_is_known():
    lines = markdown(report_of(NAN)).splitlines()
    assert [line for line in lines if line.startswith('|')] == [
        '|         |   ours |', '|:--------|-------:|', '| a scene |      - |',
        '| another |      - |']
    assert '| a scene |   2.50 |' in markdown(report_of(2.5))
    assert '- machine: one' in lines
    assert '- x' in lines


def test_progress_is_plain_lines_where_it_is_piped():
    stream = io.StringIO()
    assert list(follow([small_scene(1), small_scene(2)], 'accuracy', stream))
    assert stream.getvalue() == 'accuracy: 1 of 2 small/seed1\naccuracy: 2 of 2 small/seed2\n'
