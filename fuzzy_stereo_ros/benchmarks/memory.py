# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The memory of a matcher, as Python sees its arrays (tracemalloc)."""
import tracemalloc

from fuzzy_stereo_ros.evaluation.report import Table


def memory_row(request, size):
    """Return name, bytes held by a matcher and more during a frame, by pixel and by cell."""
    pair = size.pair()
    images = sum(image.nbytes for image in pair)
    _match_twice(request, size, pair)       # what is loaded once for all is no part of it
    tracemalloc.start()
    try:
        before = tracemalloc.get_traced_memory()[0]
        matcher = _match_twice(request, size, pair)
        held = tracemalloc.get_traced_memory()[0]
        tracemalloc.reset_peak()
        matcher.match(*pair)
        more = tracemalloc.get_traced_memory()[1] - held
        held -= before
    finally:
        tracemalloc.stop()
    return (size.name, held / 1e6, held / size.pixels, held / size.cells, more / 1e6,
            more / size.pixels, images / size.pixels)


def _match_twice(request, size, pair):
    """Return a matcher after a cold and a warm frame."""
    matcher = request.matcher(size.disparities, warm_start=True)
    for _ in range(2):
        matcher.match(*pair)
    return matcher


def memory_table(rows):
    """Return the table of rows of `memory_row`."""
    return Table('Memory', (
        '', 'held [MB]', 'bytes a pixel', 'bytes a cell', 'more during a frame [MB]',
        'bytes a pixel ', 'the pair itself, bytes a pixel'), rows,
        'Held: by a warm matcher between frames, its state among it. More: at the peak of a '
        'frame, what it returns and hands on among it.')
