# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Figures of a map are what a person counts by hand."""
import io
import math

from fuzzy_stereo_ros.evaluation.report import markdown, Report, Table
from fuzzy_stereo_ros.evaluation.scores import error_map, flicker, score
from fuzzy_stereo_ros.progress import follow
from hypothesis import given, strategies as st
from hypothesis.extra import numpy as arrays
from made_scenes import small_scene
import numpy as np
import pytest

NAN = np.nan
TRUTH = np.array([[10, 10, 10, 10, NAN], [100, 100, 100, np.inf, 100]], np.float32)
FOUND = np.array([[10, 11, 11.5, NAN, 7], [104, 106, 96.5, 3, 100]], np.float32)


def test_the_figures_are_those_counted_by_hand():
    """Errors over the 8 pixels with truth: 0, 1, 1.5, invalid; 4, 6, 3.5, 0."""
    figures = score(FOUND, TRUTH)
    assert figures.pixels == 8
    assert figures.density == pytest.approx(100 * 7 / 8)
    assert figures.bad_sparse == pytest.approx(
        {0.5: 500 / 7, 1: 400 / 7, 2: 300 / 7, 3: 300 / 7, 4: 100 / 7})
    assert figures.bad_dense == pytest.approx(
        {0.5: 75, 1: 62.5, 2: 50, 3: 50, 4: 25})
    assert figures.d1_sparse == pytest.approx(100 / 7)  # 6 of 100 is above 5 percent, 4 is not
    assert figures.d1_dense == pytest.approx(25)
    assert figures.average_error == pytest.approx(16 / 7)
    assert figures.rms_error == pytest.approx(math.sqrt((1 + 2.25 + 16 + 36 + 12.25) / 7))


def test_an_error_of_exactly_the_threshold_is_not_bad():
    figures = score(np.array([[6.0]]), np.array([[5.0]]), thresholds=(1.0, 0.99))
    assert figures.bad_dense == {1.0: 0.0, 0.99: 100.0}


def test_a_mask_leaves_pixels_out_whether_bool_or_grey():
    mask = np.zeros((2, 5), np.uint8)
    mask[0, :3] = 255
    for kind in (mask, mask == 255):
        figures = score(FOUND, TRUTH, kind)
        assert figures.pixels == 3
        assert figures.bad_dense[1.0] == pytest.approx(100 / 3)


def test_figures_over_no_pixel_are_nan_not_zero():
    nothing = score(FOUND, np.full_like(TRUTH, NAN))
    assert nothing.pixels == 0
    assert math.isnan(nothing.density) and math.isnan(nothing.bad_dense[1.0])
    empty = score(np.full_like(TRUTH, NAN), TRUTH)
    assert empty.density == 0 and empty.bad_dense[1.0] == 100
    assert math.isnan(empty.bad_sparse[1.0]) and math.isnan(empty.average_error)


def test_maps_of_different_shapes_are_rejected():
    with pytest.raises(ValueError, match=r'truth has the shape \(1, 5\), the disparity \(2, 5\)'):
        score(FOUND, TRUTH[:1])
    with pytest.raises(ValueError, match=r'mask has the shape \(2, 4\)'):
        score(FOUND, TRUTH, np.ones((2, 4)))


maps = arrays.arrays(np.float32, (4, 6), elements=st.one_of(
    st.just(float('nan')), st.floats(-100, 100, width=32)))


@given(maps)
def test_the_truth_itself_has_no_error(truth):
    figures = score(truth, truth)
    if figures.pixels:
        assert figures.density == 100 and figures.rms_error == 0 and figures.d1_dense == 0
    assert np.array_equal(error_map(truth, truth), np.where(np.isnan(truth), NAN, 0),
                          equal_nan=True)


def test_the_error_map_is_absolute_and_invalid_where_either_is():
    expected = [[0, 1, 1.5, NAN, NAN], [4, 6, 3.5, NAN, 0]]
    assert np.allclose(error_map(FOUND, TRUTH), expected, equal_nan=True)


def test_flicker_counts_changes_over_the_pixels_valid_in_both():
    after = np.array([[10, 12.5, 11.5, 5, 7], [NAN, 106, 94, 3, 100]], np.float32)
    assert flicker(FOUND, after) == pytest.approx(100 * 2 / 8)


@pytest.mark.parametrize('shift', [(0, -2), (0, 2), (1, 0), (-1, 1)])
def test_a_map_that_moves_with_the_scene_does_not_flicker(shift):
    scene = np.random.default_rng(0).uniform(0, 60, (30, 40)).astype(np.float32)
    before = scene[5:25, 5:35]
    after = scene[5 - shift[0]:25 - shift[0], 5 - shift[1]:35 - shift[1]]
    assert flicker(before, after, shift) == 0
    assert flicker(before, after) > 50


def test_flicker_rejects_what_cannot_be_compared():
    with pytest.raises(ValueError, match='one shape'):
        flicker(FOUND, FOUND[:1])
    with pytest.raises(ValueError, match='nothing is left'):
        flicker(FOUND, FOUND, (2, 0))


# ---- tables ----


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
