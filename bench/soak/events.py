# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What happens to the node in a soak: from a seed, always the same; imports no ROS."""
from typing import NamedTuple

import numpy as np

HAND = 4        # events of a round
OUTPUTS = ('confidence', 'depth/image_rect', 'points2', 'preview')
TOPICS = ('left/image_rect', 'left/camera_info', 'right/image_rect', 'right/camera_info')
DAMAGES = 'encoding', 'data', 'calibration'
CHANGES = (
    {'disparity_range': 24}, {'disparity_range': 32}, {'min_disparity': -4},
    {'warm_start': False}, {'fill': True}, {'profile': 'quality'}, {'speckle_size': 0})
REJECTIONS = (
    {'disparity_range': 0}, {'profile': 'none'}, {'min_disparity': 5000}, {'queue_size': 9})
SIZES = (0.5, 0.5), (0.75, 1.0), (1.0, 0.75), (1.25, 1.25)     # of the rows, of the columns
LARGEST = max(SIZES)


class Event(NamedTuple):
    """Something that happens: a word of `KINDS`, and what belongs to it."""

    kind: str
    values: dict


def _one_of(choices):
    return lambda random: choices[random.integers(len(choices))]


def _several_of(choices):
    return lambda random: [choices[place] for place in random.integers(
        len(choices), size=random.integers(2, 5))]


def _whole(low, high):
    return lambda random: int(random.integers(low, high + 1))


# By kind: how each of its values comes of a Generator.
KINDS = {
    'flood': {'pairs': _whole(40, 80)},
    'camera_dies': {'pairs': _whole(1, 5)},
    'camera_is_killed': {},
    'stamps_jump': {'seconds': _one_of((-3600.0, -5.0, -0.01, 0.5, 3600.0))},
    'stamps_repeat': {'pairs': _whole(2, 6)},
    'size_changes': {'share': _one_of(SIZES)},
    'sides_differ': {'share': _one_of(SIZES), 'pairs': _whole(1, 5)},
    'damage': {'how': _one_of(DAMAGES), 'pairs': _whole(1, 8)},
    'topic_is_missing': {'topic': _one_of(TOPICS), 'pairs': _whole(1, 12)},
    'silence': {},
    'parameters_change': {'changes': _several_of(CHANGES)},
    'parameters_are_rejected': {'values': _one_of(REJECTIONS)},
    'subscriber_comes_and_goes': {'topic': _one_of(OUTPUTS)},
    'all_subscribers_go': {'pairs': _whole(0, 5)},
    'reset': {},
    'save': {},
}
DECK = -(-len(KINDS) // HAND)       # rounds in which every kind has its turn


def events_of(seed, number):
    """Return the list of Events of a round; `DECK` rounds, from 0 on, have every kind once."""
    deck, hand = divmod(number, DECK)
    random = np.random.default_rng([seed, deck])
    kinds = random.permutation(list(KINDS)).tolist()
    events = [Event(kind, {name: draw(random) for name, draw in KINDS[kind].items()})
              for kind in kinds]
    return events[hand * HAND:(hand + 1) * HAND]
