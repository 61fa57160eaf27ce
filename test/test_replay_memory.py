# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A replay takes as much memory for a long bag as for a short one."""
from itertools import islice
import tracemalloc

from made_bags import scene, write_bag
import pytest
from replayed import replay

ROWS, COLUMNS = 60, 120
RESULT = 7 * ROWS * COLUMNS     # bytes, of a disparity and a preview
SHORT, LONG = 50, 500


def peak(bag, output, options=()):
    """Return the bytes that replaying a bag takes at the most."""
    tracemalloc.start()
    try:
        assert replay(bag, output=output, options=options) == 0
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize(('form', 'options'), [
    ('mcap', ['--keep']), ('sqlite3', ['--format', 'sqlite3']), ('ros1', ['--files', 'npy'])])
def test_memory_does_not_grow_with_the_length_of_a_bag(tmp_path, form, options):
    pairs = scene(10, rows=ROWS, columns=COLUMNS)
    bags = [write_bag(tmp_path / f'{frames}{".bag" if form == "ros1" else ""}', form,
                      islice(endless(pairs), frames)) for frames in (SHORT, LONG)]
    replay(bags[0], output=tmp_path / 'first', options=options)     # loads and compiles
    short, long = (peak(bag, tmp_path / f'out_{bag.stem}', options) for bag in bags)
    # Of a pair only entries of the bags' indexes are kept, 1.5 to 2.5 kB, whatever its size.
    assert long - short < (LONG - SHORT) * RESULT / 10, (short, long)


def endless(pairs):
    """Yield pairs again and again."""
    while True:
        yield from pairs
