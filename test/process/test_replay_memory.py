# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A replay takes as much memory for a long bag as for a short one."""
import gc
from itertools import cycle, islice
from statistics import median
import tracemalloc

from fuzzy_stereo_ros.replay.report import ProgressBar
from made_bags import scene, write_bag
import pytest
from replayed import replay

SHORT, LONG, WINDOW = 120, 420, 60      # pairs; all parts of a chunk pass in a window
LATER = 3               # windows at the end, as many as between them and the first one
EVERY = 4               # pairs between two looks at the memory
ROWS, COLUMNS = 96, 192
PAIR = 200              # bytes that another pair may take: its results are 129 kB
CHUNK = 3 * 2**19       # bytes by which chunks of bags that are in work may differ
RESULTS = 2**18         # bytes of two results, which may be on their way to the bag
ENTRY = 160             # bytes that rosbags keeps of each message of a bag of ROS 1


@pytest.fixture
def floors(monkeypatch):
    """Return a function: the least bytes in use in each WINDOW of a replay."""
    used = []

    def step(bar):
        used.append(None)
        if len(used) % EVERY == 0:
            gc.collect()        # empties Python's lists of free tuples, which fill up slowly
            used[-1] = tracemalloc.get_traced_memory()[0]

    def measured(bag, output, options):
        used.clear()
        gc.collect()
        gc.freeze()             # or each look would go through all that the tests before have left
        tracemalloc.start()
        try:
            assert replay(bag, output=output, options=options) == 0
        finally:
            tracemalloc.stop()
            gc.unfreeze()
        return [min(used[begin + EVERY - 1:begin + WINDOW:EVERY])
                for begin in range(0, len(used), WINDOW)]

    monkeypatch.setattr(ProgressBar, 'step', step)
    return measured


@pytest.mark.parametrize(('form', 'options', 'chunk', 'index'), [
    ('mcap', ['--keep'], CHUNK, 0), ('sqlite3', ['--format', 'sqlite3'], RESULTS, 0),
    ('ros1', ['--files', 'npy'], CHUNK, 4 * ENTRY)])
def test_memory_does_not_grow_with_the_length_of_a_bag(
        tmp_path, floors, form, options, chunk, index):
    pairs = scene(10, rows=ROWS, columns=COLUMNS)
    bags = [write_bag(tmp_path / f'{frames}{".bag" if form == "ros1" else ""}', form,
                      islice(cycle(pairs), frames)) for frames in (SHORT, LONG)]
    replay(bags[0], output=tmp_path / 'first', options=[*options, '--every', 20])   # compiles
    short, long = (floors(bag, tmp_path / f'out_{bag.stem}', options) for bag in bags)
    assert long[0] - short[0] < (LONG - SHORT) * (PAIR + index) + chunk
    assert median(long[-LATER:]) - median(long[1:-LATER]) < LATER * WINDOW * PAIR + chunk
