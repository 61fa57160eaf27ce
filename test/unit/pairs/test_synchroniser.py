# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The synchroniser: sets depend on stamps alone, every message is accounted for."""
from fuzzed import examples
from fuzzy_stereo_ros.pairs.synchroniser import Synchroniser
from hypothesis import given, strategies as st

TOPICS = ('left', 'left_info', 'right', 'right_info')


def play(synchroniser, events):
    """Add (topic, stamp) events, the message being its own name, and return the sets."""
    return [found for topic, stamp in events
            for found in synchroniser.add(topic, stamp, f'{topic}{stamp}')]


def stamps_of(sets):
    return [found.stamp for found in sets]


def check_every_message_is_accounted_for(synchroniser):
    for most_that_wait in (5, 0):
        for topic in synchroniser.topics:
            assert 0 <= synchroniser.received[topic] - (
                synchroniser.matched + synchroniser.unmatched[topic]) <= most_that_wait
        synchroniser.clear()


@st.composite
def interleaved(draw, streams):
    """Draw an order of all (topic, stamp) that keeps each topic's own order."""
    rest = {topic: list(stamps) for topic, stamps in draw(streams).items()}
    events = []
    while any(rest.values()):
        topic = draw(st.sampled_from([topic for topic in TOPICS if rest.get(topic)]))
        events.append((topic, rest[topic].pop(0)))
    return events


def streams(largest=4):
    stamps = st.lists(st.integers(0, 30), max_size=largest, unique=True).map(sorted)
    return st.fixed_dictionaries(dict.fromkeys(TOPICS, stamps))


def test_queues_are_bounded_and_the_oldest_is_let_go():
    synchroniser = Synchroniser(TOPICS, queue_size=2)
    play(synchroniser, [('left', stamp) for stamp in range(1000)])
    assert synchroniser.unmatched['left'] == 998
    others = [(topic, stamp) for stamp in (997, 998, 999) for topic in TOPICS[1:]]
    assert stamps_of(play(synchroniser, others)) == [998, 999]


def test_a_stamp_that_goes_back_starts_anew_and_says_so_once():
    synchroniser = Synchroniser(TOPICS)
    _, _, *sets = play(synchroniser, [
        (topic, stamp) for stamp in (10, 11, 3, 4, 10) for topic in TOPICS])
    assert stamps_of(sets) == [3, 4, 10]
    assert [found.went_back for found in sets] == [True, False, False]
    assert synchroniser.jumps_back == 1


def test_a_straggler_from_before_the_jump_costs_no_set():
    synchroniser = Synchroniser(TOPICS)
    play(synchroniser, [(topic, 10) for topic in TOPICS])
    events = [('left_info', 0), ('left', 11), ('right', 11), ('left', 0), ('right_info', 0),
              ('right', 0)]
    (found,) = play(synchroniser, events)
    assert (found.stamp, found.went_back) == (0, True)
    check_every_message_is_accounted_for(synchroniser)


@examples(40)
@given(interleaved(streams()))
def test_equal_stamps_give_the_same_sets_in_any_arrival_order(events):
    synchroniser = Synchroniser(TOPICS)
    found, there = [], {topic: set() for topic in TOPICS}
    for topic, stamp in events:     # a set comes out with its last message
        there[topic].add(stamp)
        whole = all(stamp in stamps for stamps in there.values())
        sets = synchroniser.add(topic, stamp, f'{topic}{stamp}')
        assert sets == [(stamp, tuple(f'{name}{stamp}' for name in TOPICS), 0, False)] * whole
        found += stamps_of(sets)
    assert found == sorted(set.intersection(*there.values()))
    newest = [max(stamps) for stamps in there.values() if stamps]
    assert synchroniser.difference() == (
        max(newest) - min(newest) if len(newest) > 1 else None)
    check_every_message_is_accounted_for(synchroniser)


@examples(40)
@given(streams(), st.data(), st.sampled_from([0, 1, 3]))
def test_nearest_stamps_give_the_same_sets_in_any_arrival_order(drawn, data, tolerance):
    results = []
    for _ in range(2):
        synchroniser = Synchroniser(TOPICS, tolerance=tolerance)
        events = data.draw(interleaved(st.just(drawn)))
        results.append(play(synchroniser, events) + synchroniser.finish())
        check_every_message_is_accounted_for(synchroniser)
    assert results[0] == results[1]
    for found in results[0]:
        joined = [int(message[len(topic):]) for topic, message in zip(TOPICS, found.messages)]
        assert found.spread == max(joined) - min(joined)
        assert not tolerance or max(abs(stamp - joined[0]) for stamp in joined) <= tolerance


@examples(40)
@given(interleaved(st.fixed_dictionaries(
    {topic: st.lists(st.integers(0, 30), max_size=20) for topic in TOPICS})),
    st.sampled_from([None, 0, 2]))
def test_stamps_in_any_disorder_lose_no_message_from_the_count(events, tolerance):
    synchroniser = Synchroniser(TOPICS, tolerance=tolerance)
    sets = play(synchroniser, events)
    assert len(sets) == synchroniser.matched
    assert sum(found.went_back for found in sets) == synchroniser.jumps_back
    check_every_message_is_accounted_for(synchroniser)


@examples(40)
@given(interleaved(streams()), st.sampled_from([None, 0, 3]))
def test_the_newest_message_of_a_cached_topic_is_in_every_set(events, tolerance):
    cached = ('left_info', 'right_info')
    synchroniser = Synchroniser(TOPICS, tolerance=tolerance, cached=cached)
    images_alone = Synchroniser(('left', 'right'), tolerance=tolerance)
    newest = {}
    for topic, stamp in events:
        sets = synchroniser.add(topic, stamp, f'{topic}{stamp}')
        if topic in cached:
            newest[topic] = f'{topic}{stamp}'
        else:
            images_alone.add(topic, stamp, stamp)
        assert len(newest) == 2 or sets == []
        assert stamps_of(sets) == sorted(stamps_of(sets))
        for found in sets:
            assert found.messages[1::2] == (newest['left_info'], newest['right_info'])
    if len(newest) == 2:
        assert synchroniser.matched == images_alone.matched


def test_a_queue_of_one_joins_nearest_stamps_as_a_queue_of_two():
    events = []
    for late in (1, -1):
        for frame in range(3):
            left = 100 * late + 10 * frame
            stamps = dict.fromkeys(TOPICS[:2], left) | dict.fromkeys(TOPICS[2:], left + late)
            events += sorted(stamps.items(), key=lambda event: event[1])
    one, two = (Synchroniser(TOPICS, queue_size, tolerance=0) for queue_size in (1, 2))
    sets = play(one, events)
    assert sets == play(two, events)
    assert stamps_of(sets) == [100, 110, -100, -90]
    check_every_message_is_accounted_for(one)


def test_a_message_is_left_to_the_pivot_that_is_nearer():
    synchroniser = Synchroniser(('left', 'right'), tolerance=0)
    events = [('left', 0), ('right', 9), ('left', 10), ('right', 19), ('left', 20)]
    sets = play(synchroniser, events) + synchroniser.finish()
    assert [found.messages for found in sets] == [('left10', 'right9'), ('left20', 'right19')]
