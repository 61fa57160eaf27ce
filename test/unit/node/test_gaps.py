# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a middleware lost is counted by the numbers of what arrived."""
from fuzzy_stereo_ros.node.gaps import Gaps
from hypothesis import given, strategies
import pytest

KEYS = 'left/image_rect', 'right/image_rect', 'right/camera_info'


@given(strategies.lists(strategies.booleans()), strategies.integers(1, 10**9))
def test_every_message_that_is_missing_between_two_others_is_counted(arrived, first):
    gaps = Gaps(KEYS)
    for number, there in enumerate([True, *arrived, True], first):
        if there:
            gaps.note(KEYS[0], number, lambda: 1)
    assert gaps.lost == {KEYS[0]: arrived.count(False), KEYS[1]: 0, KEYS[2]: 0}


@pytest.mark.parametrize('numbers, publishers', [
    ([7, 1, 2], 1),             # a camera that was started again
    ([7, None, 90], 1),         # a middleware that does not count
    ([7, 90, 8, 91], 2),        # two cameras
    ([7, 7, 8], 1)])
def test_what_need_not_be_a_gap_is_not_counted_as_one(numbers, publishers):
    gaps = Gaps(KEYS)
    for number in numbers:
        gaps.note(KEYS[0], number, lambda: publishers)
    assert gaps.lost[KEYS[0]] == 0


def test_what_was_sent_while_nobody_listened_or_by_another_camera_is_not_lost():
    gaps = Gaps(KEYS)
    gaps.note(KEYS[0], 7, lambda: 1)
    gaps.begin(KEYS[0])
    gaps.note(KEYS[0], 90, lambda: 1)
    assert gaps.lost[KEYS[0]] == 0
