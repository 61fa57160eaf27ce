# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Cost: growth is what the times say, threads are compared bit by bit, memory is what is held."""
from fuzzy_stereo_ros.benchmarks import cost, deadline
from fuzzy_stereo_ros.benchmarks.cost import (
    exponent, growth_table, memory_row, process_seconds, race, race_table, Size, steps_at_lanes,
    threads_row)
from fuzzy_stereo_ros.benchmarks.request import Request
from fuzzy_stereo_ros.evaluation.report import Table
import numpy as np
import pytest

SMALL, SAME, MORE = Size(40, 72, 16, 16), Size(40, 72, 32, 31), Size(40, 72, 33, 31)


def test_the_exponent_is_that_of_a_power_of_cells():
    for power in (0.5, 1.0, 2.0):
        assert exponent([(cells, 3 * cells**power) for cells in (10, 100, 5000)]) == \
            pytest.approx(power)
    assert np.isnan(exponent([(10, 1.0)]))


def test_a_step_is_one_disparity_behind_a_multiple_of_32_on_one_scene():
    assert steps_at_lanes(dict.fromkeys((SMALL, SAME, MORE))) == [(SAME, MORE)]
    assert steps_at_lanes(dict.fromkeys((MORE, SMALL))) == []
    assert all(len(steps_at_lanes(dict.fromkeys(sizes))) == count for sizes, count in (
        (cost.FULL.disparities, 3), (cost.FULL.pixels, 0)))


def test_sizes_that_differ_in_the_disparities_searched_share_a_scene():
    for one, other in zip(SAME.pair(), MORE.pair()):
        np.testing.assert_array_equal(one, other)


def test_tables_have_times_ratios_and_times_a_cell():
    found = {SAME: {'ours': 2.0, '3WAY': 4.0}, MORE: {'ours': 3.0, '3WAY': 8.0}}
    table = race_table('Title', found)
    assert table.columns == ('', 'ours [ms]', '3WAY [ms]', 'ours, of 3WAY', 'ours [ns a cell]',
                             '3WAY [ns a cell]')
    assert table.rows[0] == pytest.approx(
        ('72x40x32', 2.0, 4.0, 0.5, 2e6 / SAME.cells, 4e6 / SAME.cells))
    assert growth_table({'disparities': found}).rows[1] == ('33 disparities, to 32', 1.5, 2.0)


def test_ours_and_3way_take_turns_at_all_sizes():
    found = race(Request(repeats=1), (SMALL, SAME))
    assert list(found) == [SMALL, SAME]
    assert all(list(times) == ['ours, cold', 'ours, warm', '3WAY'] and min(times.values()) > 0
               for times in found.values())


def test_two_threads_have_the_bits_of_one():
    size = Size(130, 72, 16, 16)        # two bands
    for warm in (False, True):
        name, alone, together, ratio, bits = threads_row(Request(repeats=1), size, warm)
        assert name == f"72x130x16, {'warm' if warm else 'cold'}"
        assert ratio == alone / together
        assert bits == 'equal'


def test_other_bits_are_told():
    class Unequal(Request):
        def matcher(self, disparities, **forced):
            side = 'left' if forced['threads'] == 1 else 'right'
            return super().matcher(disparities, **forced, reference=side)

    assert threads_row(Unequal(repeats=1), SMALL, False)[-1] == 'DIFFERENT'


def test_a_matcher_holds_its_volume_and_gives_back_what_a_frame_takes():
    _, held, by_pixel, by_cell, more, _, images = memory_row(Request(), SAME)
    assert 1e6 * held == pytest.approx(by_pixel * SAME.pixels) == pytest.approx(
        by_cell * SAME.cells)
    assert by_cell > 2          # costs and sums
    assert 0 < more < held
    assert images == 6


def test_a_new_process_keeps_its_kernels_in_the_folder_it_is_given(tmp_path):
    told = tmp_path / 'told'
    program = f"import os; open({str(told)!r}, 'w').write(os.environ['NUMBA_CACHE_DIR'])"
    assert process_seconds(program, str(tmp_path / 'cache')) > 0
    assert told.read_text() == str(tmp_path / 'cache')
    assert 'warm_up' in cost.WARM_UP


def test_the_report_has_all_tables_and_a_quick_one_all_but_the_compiling(monkeypatch):
    monkeypatch.setattr(cost, 'compile_table', lambda: Table('Before', ('', 'seconds'), []))
    quick = cost.run(Request(repeats=1, quick=True))
    assert quick.skipped == ['compiling: it takes a minute']
    monkeypatch.setattr(cost, 'FULL', cost.QUICK)
    report = cost.run(Request(repeats=1))
    assert report.skipped == []
    assert [table.title for table in quick.tables] == [
        table.title for table in report.tables if table.title != 'Before']
    assert [table.title.split(',')[0] for table in report.tables] == [
        'Over pixels', 'Over disparities', 'Over both', 'Growth', 'Two threads', 'Memory',
        'Before']
    for table in report.tables:
        assert len(set(table.columns)) == len(table.columns)
        assert all(len(row) == len(table.columns) for row in table.rows)


def test_the_deadlines_are_measured_and_what_is_said_adds_up():
    report = deadline.run(Request(repeats=2, quick=True))
    realtime, paper = report.tables
    assert [row[0] for row in realtime.rows][0] == 'none'
    assert len(realtime.rows) == 1 + len(deadline.SHARES)
    assert len(paper.rows) == len(deadline.MILLISECONDS)
    for row in realtime.rows[1:]:
        assert 0 < row[2] <= row[3] and 0 <= row[4] <= 1
    assert paper.rows[-1][2] >= 1
