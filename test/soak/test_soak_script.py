# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What happens in a soak comes of its seed alone, and everything has its turn."""
from collections import Counter
import inspect

from hypothesis import given, strategies
import pytest
from soak_script import DECK, events_of, HAND, KINDS

SEEDS = strategies.integers(0, 2**31 - 1)


@given(SEEDS, strategies.integers(0, 999))
def test_a_seed_and_a_round_give_the_same_events_every_time(seed, number):
    assert events_of(seed, number) == events_of(seed, number)


@given(SEEDS, strategies.integers(0, 99))
def test_every_kind_has_its_turn_once_a_deck(seed, deck):
    rounds = [events_of(seed, DECK * deck + number) for number in range(DECK)]
    assert all(0 < len(events) <= HAND for events in rounds)
    kinds = Counter(event.kind for events in rounds for event in events)
    assert kinds == Counter(dict.fromkeys(KINDS, 1))


@given(SEEDS, strategies.integers(0, 99))
def test_every_event_has_the_values_of_its_kind_and_they_are_plain(seed, number):
    for event in events_of(seed, number):
        assert list(event.values) == list(KINDS[event.kind])
        for value in event.values.values():
            assert type(value) in (int, float, str, tuple, list, dict)
        assert 0 <= event.values.get('pairs', 0) <= 80


def test_another_seed_and_another_deck_are_another_story():
    stories = [[event for number in range(first, first + DECK)
                for event in events_of(seed, number)] for seed, first in
               ((1, 0), (2, 0), (1, DECK), (1, 2 * DECK))]
    assert all(one != other for place, one in enumerate(stories) for other in stories[:place])


def test_the_stage_has_a_method_for_every_kind_that_takes_its_values():
    pytest.importorskip('rclpy', reason='rclpy is not importable: no ROS 2 here')
    from soak_stage import SoakStage

    for kind, values in KINDS.items():
        _, *taken = inspect.signature(getattr(SoakStage, kind)).parameters.values()
        needed = [one.name for one in taken if one.default is inspect.Parameter.empty]
        assert needed == list(values), kind
