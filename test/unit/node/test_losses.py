# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the log says of pairs and messages that were lost by design."""
from collections import Counter
import re

from fuzzy_stereo_ros.node.losses import Losses
from hypothesis import given, strategies

KEYS = 'pairs dropped', 'unmatched left/image_rect', 'unmatched right/camera_info'


def told(lines):
    """Return a Counter of the numbers in lines."""
    found = Counter()
    for line in lines:
        for key, number in re.findall(rf"({'|'.join(KEYS)}) (\d+)", line):
            found[key] += int(number)
    return found


def test_the_first_loss_is_told_at_once_then_one_line_a_period_with_what_came_since():
    losses = Losses(period=60.0)
    assert losses.lines(10.0, {'pairs dropped': 0, 'pairs matched': 9}) == []
    assert losses.lines(11.0, {'pairs dropped': 2}) == [
        'since such a line: pairs dropped 2; newer ones came before they were matched, see scale '
        'and disparity_range']
    assert losses.lines(70.9, {'pairs dropped': 7}) == []
    assert told(losses.lines(71.0, {'pairs dropped': 8})) == {'pairs dropped': 6}
    assert losses.lines(200.0, {'pairs dropped': 8}) == []


def test_one_kind_does_not_hold_back_another_and_topics_share_a_line():
    losses = Losses()
    losses.lines(0.0, {'pairs dropped': 1})
    line, = losses.lines(1.0, {'pairs dropped': 2, 'unmatched left/image_rect': 3,
                               'unmatched right/camera_info': 4})
    assert line == (
        'since such a line: unmatched left/image_rect 3, unmatched right/camera_info 4; the '
        'other topics had not come with their stamps when newer ones came, the stamps went back '
        'or nobody listened any more, see queue_size and approximate_sync')


@given(strategies.lists(strategies.tuples(
    strategies.floats(0, 100), strategies.sampled_from(KEYS), strategies.integers(0, 9))))
def test_the_numbers_of_all_lines_add_up_to_the_counts(steps):
    losses, now, counts, lines = Losses(), 0.0, Counter(dict.fromkeys(KEYS, 0)), []
    for seconds, key, number in steps:
        now += seconds
        counts[key] += number
        lines += losses.lines(now, counts)
    lines += losses.lines(now, counts, last=True)
    assert told(lines) == +counts
