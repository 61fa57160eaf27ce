# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The table of the suite `speed` that reckons more cores than there are."""
from bench.cores import scheduled, together
import pytest


def independent(*times):
    return [(milliseconds, 0) for milliseconds in times]


@pytest.mark.parametrize('times, cores, ends', [
    ([3, 1, 1, 1], 2, 3), ([1, 1, 1, 3], 2, 4), ([1, 1, 1, 3], 4, 3), ([2, 2], 1, 4), ([], 4, 0)])
def test_a_part_is_done_by_the_core_that_is_free_first(times, cores, ends):
    assert scheduled(independent(*times), cores) == ends


@pytest.mark.parametrize('parts, cores, ends', [
    ([(1, 0), (3, 0), (1, 1), (1, 2)], 2, 4), ([(1, 0), (3, 0), (1, 1), (1, 2)], 1, 6),
    ([(1, 0), (1, 1), (1, 2)], 8, 3), ([(1, 0), (4, 0), (1, 2), (1, 0)], 2, 5)])
def test_a_part_waits_on_its_core_for_the_first_ones_that_it_needs(parts, cores, ends):
    assert scheduled(parts, cores) == ends


def test_what_is_alone_and_the_cost_of_joins_add_to_the_time_of_a_frame():
    joins = [independent(2, 2), independent(4)]
    assert together(joins, 2, 1, 5) == 10
    assert together(joins, 2, 2, 0) == 8
    assert together(joins, 2, 16, 2) == 10
