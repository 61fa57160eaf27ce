# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the node says about itself, without ROS."""
from types import SimpleNamespace

from fuzzy_stereo_ros.reports import Figures, MOST_KINDS, Rates, Throttle, verdict
import numpy as np
import pytest


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


def test_at_the_end_all_that_was_held_back_is_told():
    throttle = Throttle()
    throttle.note('step is 3', 10.0)
    throttle.note('step is 4', 11.0)
    assert throttle.due(11.0, last=True) == ['step is 4 (1 times in the last 1 s)']
    assert throttle.due(99.0, last=True) == []


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
            latency=milliseconds)
    figures.refuse('size')
    assert figures.values() == {
        'refused: size': '1', 'latency, last': '30.0 ms', 'latency, median': '20.0 ms',
        'latency, 95th percentile': '29.0 ms', 'time of total, last': '15.0 ms',
        'time of total, median': '10.0 ms', 'time of total, 95th percentile': '14.5 ms',
        'generations': '2', 'warm': 'true', 'mean confidence': '0.250', 'valid share': '0.500'}


@pytest.mark.parametrize('ready, subscribed, quiet, rates, expected', [
    (False, False, 0, {}, ('STALE', 'loading the kernels')),
    (True, False, 0, {}, ('OK', 'idle: no output has a subscriber')),
    (True, True, 6.2, {}, ('ERROR', 'no stereo pair for 6 s')),
    (True, True, 0, {'refused': 2}, ('WARN', 'refusing 2.0 pairs/s')),
    (True, True, 0, {'refused': 2, 'matched': 0}, ('ERROR', 'refusing 2.0 pairs/s')),
    (True, True, 0, {'dropped': 9.4}, ('OK', 'matching 9.5 pairs/s')),
    (True, True, 0, {'dropped': 20.5}, (
        'WARN', 'matching 9.5 pairs/s and dropping 20.5: they come faster than they can be '
        'matched; see scale and disparity_range')),
])
def test_the_verdict_is_the_worst_that_is_true(ready, subscribed, quiet, rates, expected):
    rates = {f'pairs {how}': {'refused': 0, 'dropped': 0, 'matched': 9.5, **rates}[how]
             for how in ('refused', 'dropped', 'matched')}
    assert verdict(ready, subscribed, quiet, rates) == expected
