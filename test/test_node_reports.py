# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the node says about itself, without ROS."""
from types import SimpleNamespace

from fuzzy_stereo_ros.node_reports import (
    Figures, MOST_KINDS, no_pair_report, Rates, Throttle, TopicState, verdict)
import numpy as np
import pytest

NAMES = ('/left/image_rect', '/left/camera_info', '/right/image_rect', '/right/camera_info')


def states(**changes):
    """Return four topics with messages and a publisher; changes by place, as in at2={...}."""
    return [TopicState(**{'name': name, 'received': 9, 'publishers': 1,
                          **changes.get(f'at{place}', {})}) for place, name in enumerate(NAMES)]


def test_the_first_sentence_goes_out_at_once_then_one_per_period_with_the_count():
    throttle = Throttle(period=5.0)
    assert throttle.note('step is 3', 10.0) == 'step is 3'
    assert throttle.note('step is 4', 11.0) is None
    assert throttle.note('step is 5', 12.0) is None
    assert throttle.due(14.9) == []
    assert throttle.due(15.0) == ['step is 5 (2 times in the last 5 s)']
    assert throttle.due(99.0) == []
    assert throttle.note('step is 6', 100.0) == 'step is 6'


def test_a_sentence_of_another_kind_is_not_held_back():
    throttle = Throttle()
    assert throttle.note('step is 3', 10.0)
    assert throttle.note('no size', 10.0)


def test_kinds_without_end_are_thrown_together():
    throttle = Throttle()
    lines = [throttle.note(f"encoding is '{'x' * length}'", 1.0) for length in range(500)]
    assert sum(line is not None for line in lines) == MOST_KINDS + 1


def test_rates_count_per_second_since_the_call_before():
    rates = Rates(10.0)
    assert rates.since(12.0, {'pairs': 6}) == {'pairs': 3.0}
    assert rates.since(16.0, {'pairs': 6}) == {'pairs': 0.0}


def test_figures_tell_the_times_and_what_the_newest_match_was_like():
    figures = Figures()
    assert figures.values() == {}
    for milliseconds in (10.0, 20.0, 30.0):
        figures.matched(SimpleNamespace(
            times={'total': milliseconds / 2}, generations=2, warm=True,
            disparity=np.float32([[1, np.nan]]), confidence=np.float32([[0.5, 0.0]])),
            milliseconds)
    figures.refuse('size')
    assert figures.values() == {
        'refused: size': '1', 'latency, median': '20.0 ms', 'latency, 95th percentile': '29.0 ms',
        'time of total, median': '10.0 ms', 'time of total, 95th percentile': '14.5 ms',
        'generations': '2', 'warm': 'true', 'mean confidence': '0.250', 'valid share': '0.500'}


@pytest.mark.parametrize('ready, subscribed, quiet, refused, expected', [
    (False, False, 0, 0, ('STALE', 'loading the kernels')),
    (True, False, 0, 0, ('OK', 'idle: no output has a subscriber')),
    (True, True, 6.2, 0, ('ERROR', 'no stereo pair for 6 s')),
    (True, True, 0, 2, ('WARN', 'refusing 2.0 pairs/s')),
    (True, True, 0, 0, ('OK', 'matching 9.5 pairs/s')),
])
def test_the_verdict_is_the_worst_that_is_true(ready, subscribed, quiet, refused, expected):
    rates = {'pairs refused': refused, 'pairs matched': 9.5}
    assert verdict(ready, subscribed, quiet, rates) == expected


@pytest.mark.parametrize('topics, options, expected', [
    (states(at1={'received': 0, 'publishers': 0}), {},
     'nobody publishes /left/camera_info: start the camera driver, or remap the topic'),
    (states(at0={'received': 0, 'incompatible': 'reliability'}), {},
     '/left/image_rect is offered with an incompatible QoS (reliability): set '
     'qos_overrides./left/image_rect.subscription.reliability'),
    (states(at2={'received': 0}), {},
     'nothing arrives from the publishers of /right/image_rect: they may be silent, and Fast DDS '
     'loses large best-effort images unless both sides run with FASTRTPS_DEFAULT_PROFILES_FILE '
     "set to this package's config/fastdds.xml"),
    (states(at2={'received': 0}), {'large_messages_pass': True},
     'nothing arrives from the publishers of /right/image_rect: they may be silent'),
    (states(), {},
     'no stamp came on all four topics: set approximate_sync if the cameras do not stamp alike, '
     'or a larger queue_size'),
    (states(), {'approximate': True},
     'stamps differ by more than approximate_sync_tolerance_seconds, or queue_size is too small'),
])
def test_the_report_ends_with_what_to_do(topics, options, expected):
    options = {'approximate': False, 'large_messages_pass': False, **options}
    report = no_pair_report(5.4, topics, 1_500_000, **options)
    counts = ', '.join(f'{topic.name} {topic.received}' for topic in topics)
    assert report == (f'no stereo pair for 5 s; messages since then: {counts}; the latest stamps '
                      f'differ by up to 1.500 ms; {expected}')
