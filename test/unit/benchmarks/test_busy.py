# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Times beside busy processes: they run meanwhile and no longer, and each frame counts."""
from pathlib import Path
import time

from fuzzy_stereo_ros.benchmarks import busy
import pytest


def children():
    """Return the processes that this one has begun and that have not ended."""
    return Path('/proc/thread-self/children').read_text(encoding='ascii').split()


@pytest.mark.skipif(not Path('/proc/thread-self/children').exists(), reason='needs Linux')
def test_busy_processes_run_during_the_block_alone():
    before = children()
    with busy.busy_processes(2):
        assert len(children()) == len(before) + 2
    assert children() == before


def test_the_table_has_median_and_95th_percentile_of_frames_that_have_settled(monkeypatch):
    monkeypatch.setattr(busy, 'BUSY', (0, 1))
    monkeypatch.setattr(busy, 'COUNT', 20)
    monkeypatch.setattr(busy, 'PAUSE', 0.0)
    clock, called = iter(range(10**6)), []
    monkeypatch.setattr(busy, '_milliseconds', lambda work, number: work(number))

    def work(number):
        called.append(number)
        place = next(clock) % (20 + busy.SETTLING)
        return 1e6 if place < busy.SETTLING else float(place - busy.SETTLING)
    table = busy.busy_table({'one': work}, 4, quick=False)
    assert table.columns == ('', 'one, median [ms]', 'one, 95th percentile [ms]')
    assert table.rows == [(name, 9.5, pytest.approx(18.05))
                          for name in ('0 busy processes', '1 busy process')]
    assert set(called) == {0, 1, 2, 3}


def test_each_frame_begins_with_the_next_matcher(monkeypatch):
    monkeypatch.setattr(busy, 'PAUSE', 0.0)
    called = []
    works = {name: lambda _, name=name: called.append(name) for name in 'abc'}
    busy.busy_table(works, 4, quick=True)
    assert ''.join(called[:9]) == 'abcbcacab'


def test_the_pause_before_a_frame_is_not_counted():
    taken = busy._milliseconds(lambda number: time.sleep(0.001), 0)
    assert 1 <= taken < 1000 * busy.PAUSE
