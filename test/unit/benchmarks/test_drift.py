# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The report of drift: what was made is what is found, with the warning that belongs to it."""
from fuzzy_stereo_ros.benchmarks import drift
import pytest
from small_scenes import request_for, small_scene

SmallRequest = request_for([small_scene(1, 'made', 'one', (120, 320, 24), noise=1.0)],
                           ([], ['a group', 'a folder']))


@pytest.mark.slow
def test_the_report_has_known_and_detected_misalignment_and_the_cost():
    report = drift.run(SmallRequest(quick=True))
    made, swings, real, cost = report.tables
    for row, error in zip(made.rows, drift.ERRORS, strict=True):
        assert row[1:4] == pytest.approx([error.get(name, 0.0) for name in (
            'tilt', 'roll', 'zoom')], abs=0.2)
        assert row[4] < 0.1 and len(row) == len(made.columns)
    assert [row[-1] for row in swings.rows] == ['none', 'timing']
    assert [(row[0], row[-1]) for row in real.rows] == [
        ('made/one', 'none'), ('made/one, turned by 0.2 degrees', 'roll')]
    (row,) = cost.rows
    assert row[3] == pytest.approx(100 * row[2] / row[1])
    assert report.skipped == ['a group', 'a folder']


def test_images_too_small_to_be_measured_have_no_figures():
    small = small_scene(1, 'made', 'small')
    assert drift._real_rows(SmallRequest(), small)[0] == ('made/small', *[None] * 6)
