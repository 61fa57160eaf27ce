# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Where segments begin, what warms them up, and that no more of them is held than is needed."""
from concurrent.futures import Future
import weakref

from fuzzy_stereo_ros.bags.reading import BagMessage, DamagedBag
from fuzzy_stereo_ros.matching import MatcherConfig
from fuzzy_stereo_ros.matching.match import Match
from fuzzy_stereo_ros.pairs.stereo_pair import StereoPair
from fuzzy_stereo_ros.replay.loop import Tally
from fuzzy_stereo_ros.replay.request import WARM_PAIRS
from fuzzy_stereo_ros.replay.segment_matching import match_segment, SegmentAnswer, SegmentOrder
from fuzzy_stereo_ros.replay.segments import (
    AHEAD, CopiesBetween, cut, SEGMENT_PAIRS, SegmentedReplay)
from fuzzy_stereo_ros.replay.source import HELD_BYTES, Step
from hypothesis import given, strategies
from made_bags import DISPARITIES, scene, stamps
import numpy as np
import pytest
from replayed import matches

BLANK = np.zeros((2, 2), np.uint8)


def step(number, **changes):
    """Return a Step with a pair of a number, which is its time too."""
    return Step(number, number, number, **{
        'pair': StereoPair(BLANK, BLANK, None, number), **changes})


def numbers(steps):
    return [one.number for one in steps]


@given(first=strategies.integers(0, 200), length=strategies.integers(1, 200),
       refused=strategies.sets(strategies.integers(0, 400)))
def test_segments_begin_at_multiples_of_their_length_wherever_the_steps_begin(
        first, length, refused):
    steps = [step(number, **({'pair': None} if number in refused else {}))
             for number in range(first, first + length)]
    segments = list(cut(steps))
    assert [one for segment in segments for one in segment.steps] == steps
    for segment in segments:
        begin = segment.steps[0].number
        assert begin in (first, begin // SEGMENT_PAIRS * SEGMENT_PAIRS)
        assert len({number // SEGMENT_PAIRS for number in numbers(segment.steps)}) == 1
        assert numbers(segment.before) == list(
            range(max(first, begin - WARM_PAIRS), begin)) * (begin > first)
        pairs, warming = segment.pairs()
        assert [pair.stamp for pair, _ in pairs] == [
            number for number in numbers([*segment.before, *segment.steps])
            if number not in refused]
        assert warming == len([one for one in segment.before if one.pair is not None])


def test_a_pair_after_a_bad_one_with_which_stamps_went_back_starts_anew():
    (segment,) = cut([step(0), step(1, pair=None, went_back=True), step(2), step(3),
                      step(4, went_back=True)])
    assert [anew for _, anew in segment.pairs()[0]] == [False, True, False, True]


def test_what_has_no_number_stays_where_it_is():
    bare = Step(7)
    (segment,) = cut([bare, step(0), bare, step(1), bare])
    assert numbers(segment.steps) == [None, 0, None, 1, None]


def test_a_damage_comes_after_the_segment_that_it_ends():
    def steps():
        yield step(0)
        raise DamagedBag('damaged')

    found = cut(steps())
    assert numbers(next(found).steps) == [0]
    with pytest.raises(DamagedBag, match='damaged'):
        next(found)


class Source:
    """Steps of pairs that are made one by one, and how many of them are held."""

    def __init__(self, length, done=0):
        """Make nothing yet; done: so many of the steps come again."""
        self._length, self._done, self.held = length, done, weakref.WeakSet()
        self.most = 0

    def steps(self):
        """Yield the steps, noting how many of them are held."""
        for number in range(self._length):
            pair = Pair(number)
            self.held.add(pair)
            self.most = max(self.most, len(self.held))
            yield Step(number, number, number, pair, again=number < self._done)


class Pair:
    """What stands for a pair."""

    def __init__(self, number):
        """Be the pair of a number."""
        self.number = number


class Workers:
    """Workers that answer at once with the number of each pair."""

    config, workers = None, 2

    def __init__(self):
        """Ask nobody yet."""
        self.asked = []

    def ask(self, pairs, warming):
        """Note what is asked and answer it."""
        found, answer = [pair.number for pair, _ in pairs], Future()
        self.asked.append((found[0], warming))
        answer.set_result(SegmentAnswer((warming, 1, 0.5), tuple(found[warming:])))
        return answer

    def answer(self, asked, stopped):
        """Return the answer."""
        return asked.result()


def replayed(source, workers, tally, stopped=lambda: False):
    """Return the steps of a source, and the answer to each pair of theirs."""
    chain, found = SegmentedReplay(source, workers, tally, stopped), []
    for one in chain.steps():
        matched = None if one.pair is None else chain.match_pair(one.pair)
        found.append((one.number, matched and matched.match))
    return found


def test_each_pair_has_its_answer_and_few_pairs_are_held():
    source, workers, tally = Source(40 * SEGMENT_PAIRS), Workers(), Tally()
    found = replayed(source, workers, tally)
    assert found == [(number, number) for number in range(40 * SEGMENT_PAIRS)]
    assert source.most <= (AHEAD * workers.workers + 2) * SEGMENT_PAIRS + WARM_PAIRS
    assert (tally.segments, tally.workers) == (40, 2)
    assert (tally.again, tally.warm, tally.milliseconds) == (39 * WARM_PAIRS, 40, 20.0)


def test_segments_that_were_written_before_are_passed_over():
    done = 2 * SEGMENT_PAIRS + 5
    source, workers = Source(3 * SEGMENT_PAIRS, done), Workers()
    found = replayed(source, workers, Tally())
    assert workers.asked == [(2 * SEGMENT_PAIRS - WARM_PAIRS, WARM_PAIRS)]
    assert found == [(number, number if number >= 2 * SEGMENT_PAIRS else None)
                     for number in range(3 * SEGMENT_PAIRS)]


@pytest.mark.parametrize('looks', [0, 20, 3 * SEGMENT_PAIRS, 3 * SEGMENT_PAIRS + 5])
def test_what_is_stopped_ends_with_a_step_at_which_that_is_seen(looks):
    workers = Workers()
    workers.answer = lambda asked, stopped: None if stopped() else asked.result()
    countdown = iter([False] * looks)
    *before, last = SegmentedReplay(
        Source(3 * SEGMENT_PAIRS), workers, Tally(), lambda: next(countdown, True)).steps()
    assert len(before) % SEGMENT_PAIRS == 0
    assert last == Step(0)


def messages(times, size=1):
    """Return BagMessages, recorded at times."""
    return [BagMessage('/topic', time, bytes(size), None, None) for time in times]


@given(times=strategies.lists(strategies.integers(0, 50)),
       marks=strategies.lists(strategies.integers(0, 50)))
def test_each_message_is_copied_before_the_first_step_that_is_not_earlier(times, marks):
    copied, marks = messages(sorted(times)), sorted(marks)
    between = CopiesBetween(copied)
    found = [[one] for mark in marks for one in between.before(Step(mark))]
    assert [one.logged for one, in found] == marks
    last = -1
    for (one,), mark in zip(found, marks):
        assert [copy.logged for copy in one.copies] == [
            time for time in sorted(times) if last < time <= mark]
        last = mark
    assert [copy for (one,) in found for copy in one.copies] + [
        copy for one in between.rest() for copy in one.copies] == copied


def test_many_copies_are_given_in_pieces():
    size = HELD_BYTES // 3
    between = CopiesBetween(messages(range(10), size))
    found = list(between.before(step(8)))
    assert [len(one.copies) for one in found] == [4, 4, 1]
    assert numbers(found) == [None, None, 8]
    assert [len(one.copies) for one in between.rest()] == [1]


def test_a_damage_among_copies_ends_the_steps_after_what_stands_before_it():
    def damaged():
        yield from messages([1, 2])
        raise DamagedBag('damaged')

    between = CopiesBetween(damaged())
    (one,) = between.before(step(3))
    assert [copy.logged for copy in one.copies] == [1, 2]
    for after in (between.before(step(4)), between.rest()):
        with pytest.raises(DamagedBag, match='damaged'):
            next(after)


def order(frames, anew=()):
    """Return the SegmentOrder of made pairs; anew: numbers of those that start anew."""
    return SegmentOrder(MatcherConfig(disparities=DISPARITIES), tuple(
        (StereoPair(pair.left, pair.right, None, stamp), number in anew)
        for number, (pair, stamp) in enumerate(zip(scene(frames), stamps(frames)))))


@pytest.mark.parametrize('threads', [1, 2])
def test_a_segment_is_matched_as_if_nothing_had_been_before(threads):
    whole = order(8, anew={5})
    match_segment(SegmentOrder(whole.config, whole.pairs[:2]), threads)
    found = match_segment(SegmentOrder(whole.config, whole.pairs[2:], 2), threads)
    expected = [*matches(scene(8)[2:5], stamps(8)[2:5]), *matches(scene(8)[5:], stamps(8)[5:])]
    assert found.warming[:2] == (2, 1)
    assert found.warming[2] > 0
    for one, other in zip(found.answers, expected[2:], strict=True):
        np.testing.assert_array_equal(one.disparity, other.disparity)
        np.testing.assert_array_equal(one.confidence, other.confidence)


def test_a_pair_that_cannot_be_matched_is_answered_with_why():
    small = StereoPair(BLANK, BLANK, None, stamps(9)[8])
    whole = order(4)
    found = match_segment(SegmentOrder(
        whole.config, (*whole.pairs[:2], (small, False), *whole.pairs[2:]), 1), 1)
    assert [type(one) for one in found.answers] == [Match, ValueError, Match, Match]
    assert 'disparities' in str(found.answers[1])


def test_a_segment_that_nobody_wants_any_more_is_given_up():
    wishes = iter([True, True, False])
    assert match_segment(order(6), 1, lambda: next(wishes)) is None
