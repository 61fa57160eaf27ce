# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Where segments begin, what warms them up, and that no more of them is held than is needed."""
import weakref

from fuzzy_stereo_ros.bags.reading import DamagedBag
from fuzzy_stereo_ros.matching import MatcherConfig
from fuzzy_stereo_ros.matching.match import Match
from fuzzy_stereo_ros.pair_matcher import camera_of
from fuzzy_stereo_ros.pairs.camera_files import centred_calibration
from fuzzy_stereo_ros.pairs.stereo_pair import StereoPair
from fuzzy_stereo_ros.replay.loop import Stats
from fuzzy_stereo_ros.replay.options import SEGMENT_PAIRS, WARM_PAIRS
from fuzzy_stereo_ros.replay.segments import (
    cut_into_segments, match_in_segments, match_segment, SegmentResult, SEGMENTS_PER_WORKER)
from fuzzy_stereo_ros.replay.source import Item, Rejection
from hypothesis import given, strategies
from made_bags import BASELINE, COLUMNS, DISPARITIES, FOCAL, ROWS, scene, stamps
import numpy as np
import pytest
from replayed import matches

BLANK = np.zeros((2, 2), np.uint8)
CALIBRATION = centred_calibration(FOCAL, BASELINE, 0.0, ROWS, COLUMNS)


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


class Source:
    """Steps of pairs that are made one by one, and how many of them are held."""

    def __init__(self, length, done=0):
        """Make nothing yet; done: so many of the items are written already."""
        self._length, self._done, self.held = length, done, weakref.WeakSet()
        self.most = 0

    def items(self):
        """Yield the items, noting how many of them are held."""
        for number in range(self._length):
            one = item(number, pair=Pair(BLANK, BLANK, None, number), written=number < self._done)
            self.held.add(one.pair)
            self.most = max(self.most, len(self.held))
            yield one


class Workers:
    """Workers whose result is at once the stamp of each pair."""

    workers = 2

    def __init__(self):
        """Ask nobody yet."""
        self.asked = []

    def submit(self, pairs, warming):
        """Note what is asked and answer it."""
        found = [pair.stamp for pair, _ in pairs]
        self.asked.append((found[0], warming))
        return SegmentResult((warming, 1, 0.5), found[warming:])

    def result(self, future, stopped):
        """Return the result."""
        return None if stopped() else future


def outcomes(source, workers, stats, stopped=lambda: False):
    """Return (number of an item, outcome) of the items of a source."""
    return [(one.number, outcome)
            for one, outcome in match_in_segments(source.items(), workers, stats, stopped)]


def test_each_pair_has_its_answer_and_few_pairs_are_held():
    source, workers, stats = Source(40 * SEGMENT_PAIRS), Workers(), Stats()
    found = outcomes(source, workers, stats)
    assert found == [(number, number) for number in range(40 * SEGMENT_PAIRS)]
    assert source.most <= WARM_PAIRS + SEGMENT_PAIRS * (
        SEGMENTS_PER_WORKER * workers.workers + 2)
    assert (stats.segments, stats.workers) == (40, 2)
    assert (stats.rematched, stats.warm, stats.milliseconds) == (39 * WARM_PAIRS, 40, 20.0)


def test_segments_that_were_written_before_are_passed_over():
    done = 2 * SEGMENT_PAIRS + 5
    source, workers = Source(3 * SEGMENT_PAIRS, done), Workers()
    found = outcomes(source, workers, Stats())
    assert workers.asked == [(2 * SEGMENT_PAIRS - WARM_PAIRS, WARM_PAIRS)]
    assert found == [(number, number if number >= 2 * SEGMENT_PAIRS else None)
                     for number in range(3 * SEGMENT_PAIRS)]


@pytest.mark.parametrize('looks', [0, 1, 3, 4, 7])
def test_an_interruption_ends_between_two_segments(looks):
    countdown = iter([False] * looks)
    found = outcomes(Source(9 * SEGMENT_PAIRS), Workers(), Stats(), lambda: next(countdown, True))
    assert len(found) < 9 * SEGMENT_PAIRS
    assert len(found) % SEGMENT_PAIRS == 0


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


def in_a_row(frames, anew=()):
    """Return [(StereoPair, whether it starts anew)] of made pairs; anew: numbers of those."""
    return [(StereoPair(pair.left, pair.right, CALIBRATION, stamp), number in anew)
            for number, (pair, stamp) in enumerate(zip(scene(frames), stamps(frames)))]


CONFIG = MatcherConfig(disparities=DISPARITIES)


@pytest.mark.parametrize('profile, threads', [
    ('realtime', 2), pytest.param('quality', 1, marks=pytest.mark.slow)])
def test_a_segment_is_matched_as_if_nothing_had_been_before(profile, threads):
    config = MatcherConfig.from_profile(profile, disparities=DISPARITIES, threads=threads)
    pairs = in_a_row(8, anew={5})
    match_segment(config, pairs[:2], 0)
    found = match_segment(config, pairs[2:], 2)
    camera = camera_of(pairs[0][0])
    expected = [one for part in (slice(2, 5), slice(5, None))
                for one in matches(scene(8)[part], stamps(8)[part], camera=camera,
                                   profile=profile)]
    assert found.warming[:2] == (2, 1)
    assert found.warming[2] > 0
    for one, other in zip(found.outcomes, expected[2:], strict=True):
        np.testing.assert_array_equal(one.disparity, other.disparity)
        np.testing.assert_array_equal(one.confidence, other.confidence)


def test_a_pair_that_cannot_be_matched_is_answered_with_why():
    small, pairs = StereoPair(BLANK, BLANK, CALIBRATION, stamps(9)[8]), in_a_row(4)
    found = match_segment(CONFIG, [*pairs[:2], (small, False), *pairs[2:]], 1)
    assert [type(one) for one in found.outcomes] == [Match, Rejection, Match, Match]
    assert 'disparities' in found.outcomes[1].sentence
