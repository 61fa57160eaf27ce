# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Where segments begin, what warms them up, and that no more of them is held than is needed."""
import weakref

from fuzzy_stereo_ros.bags.reading import DamagedBag
from fuzzy_stereo_ros.pairs.stereo_pair import StereoPair
from fuzzy_stereo_ros.replay.loop import Stats
from fuzzy_stereo_ros.replay.options import SEGMENT_PAIRS, WARM_PAIRS
from fuzzy_stereo_ros.replay.segments import (
    cut_into_segments, match_in_segments, SegmentResult, SEGMENTS_PER_WORKER)
from fuzzy_stereo_ros.replay.source import Item, Rejection
from hypothesis import given, strategies
import numpy as np
import pytest

BLANK = np.zeros((2, 2), np.uint8)


def item(number, **changes):
    """Return an Item with a pair of a number, which is its time too."""
    return Item(number, number, number, **{
        'pair': StereoPair(BLANK, BLANK, None, number), **changes})


def numbers(items):
    return [one.number for one in items]


@given(first=strategies.integers(0, 200), length=strategies.integers(1, 200),
       rejected=strategies.sets(strategies.integers(0, 400)))
def test_segments_begin_at_multiples_of_their_length_wherever_the_steps_begin(
        first, length, rejected):
    items = [item(number, **({'pair': None} if number in rejected else {}))
             for number in range(first, first + length)]
    segments = list(cut_into_segments(items))
    assert [one for segment in segments for one in segment.items] == items
    for segment in segments:
        begin = segment.items[0].number
        assert begin in (first, begin // SEGMENT_PAIRS * SEGMENT_PAIRS)
        assert len({number // SEGMENT_PAIRS for number in numbers(segment.items)}) == 1
        assert numbers(segment.before) == list(
            range(max(first, begin - WARM_PAIRS), begin)) * (begin > first)
        pairs, warming = segment.pairs()
        assert [pair.stamp for pair, _ in pairs] == [
            number for number in numbers([*segment.before, *segment.items])
            if number not in rejected]
        assert warming == len([one for one in segment.before if one.pair is not None])


def test_a_jump_back_at_a_bad_pair_resets_the_matcher_before_the_next_one():
    (segment,) = cut_into_segments([item(0), item(1, pair=None, went_back=True), item(2),
                                    item(3), item(4, went_back=True)])
    assert [anew for _, anew in segment.pairs()[0]] == [False, True, False, True]


class Pair(StereoPair):
    """A pair that can be in a set."""

    __hash__ = object.__hash__


class Workers:
    """Workers whose result is at once the stamp of each pair."""

    workers = 2

    def submit(self, pairs, warming):
        return SegmentResult((warming, 1, 0.5), [pair.stamp for pair, _ in pairs][warming:])

    def result(self, future, stopped):
        return None if stopped() else future


def test_each_pair_has_its_answer_and_few_pairs_are_held():
    held, most, stats = weakref.WeakSet(), [], Stats()

    def items():
        for number in range(40 * SEGMENT_PAIRS):
            one = item(number, pair=Pair(BLANK, BLANK, None, number))
            held.add(one.pair)
            most.append(len(held))
            yield one

    found = [(one.number, outcome) for one, outcome in match_in_segments(
        items(), Workers(), stats, lambda: False)]
    assert found == [(number, number) for number in range(40 * SEGMENT_PAIRS)]
    assert max(most) <= WARM_PAIRS + SEGMENT_PAIRS * (SEGMENTS_PER_WORKER * Workers.workers + 2)
    assert (stats.segments, stats.workers) == (40, 2)
    assert (stats.rematched, stats.warm, stats.milliseconds) == (39 * WARM_PAIRS, 40, 20.0)


def test_a_damage_comes_after_the_pairs_before_it_and_a_rejection_in_its_place():
    def items():
        yield item(0)
        yield item(1, pair=Rejection('size', 'too small'))
        raise DamagedBag('damaged')

    found = match_in_segments(items(), Workers(), Stats(), lambda: False)
    assert [outcome for _, outcome in (next(found), next(found))] == [
        0, Rejection('size', 'too small')]
    with pytest.raises(DamagedBag, match='damaged'):
        next(found)
