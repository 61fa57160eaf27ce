# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Tables and progress in text."""
import io

from fuzzy_stereo_ros.evaluation.report import markdown, Report, Table
from fuzzy_stereo_ros.progress import follow
from made_scenes import small_scene
import numpy as np

NAN = np.nan


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
