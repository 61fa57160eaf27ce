# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A soak sees every promise that is broken: made figures, each wrong in one place."""
from contextlib import contextmanager
import os
import threading
from types import SimpleNamespace

import pytest
from soak_figures import (
    broken_sums, growth, losses_told, promises_of, Run, Sample, spread, Threads, threads_of)
from soak_script import TOPICS
from soak_waits import Wait, Waits

LIMITS = {'memory': 1.0, 'resident': 5.0, 'latency': 50.0, 'work': 20.0, 'wait': 10.0}
SENT = dict.fromkeys(TOPICS, 30)
COUNTS = {'pairs synchronised': 28, 'pairs matched': 20, 'pairs dropped': 5, 'pairs refused': 3,
          'pairs waiting': 0, 'refused: size': 2, 'refused: encoding': 1, 'queue_size': 5,
          **{f'received {topic}': 30 for topic in TOPICS},
          **{f'unmatched {topic}': 2 for topic in TOPICS},
          **{f'lost {topic}': 0 for topic in TOPICS}}
UNMATCHED = ', '.join(f'unmatched {topic} 2' for topic in TOPICS)
LOG = f"""\
[INFO] [1.5] [disparity_node]: ready: the kernels are warm after 2.0 s
[INFO] [2.5] [disparity_node]: since the last report: pairs dropped 1; newer ones came
[ERROR] [3.5] [disparity_node]: pair refused: the left image is 2x3, the right one 4x3
[INFO] [3.6] [disparity_node]: since the last report: pairs refused 3; they cannot
[INFO] [9.6] [disparity_node]: since the last report: pairs dropped 4; newer ones came
[INFO] [9.6] [disparity_node]: since the last report: {UNMATCHED}; their stamps"""
SAMPLES = [Sample(100.0, 9000, 150.0, 25.0, 2.0, 20.0)] * 6
WAITS = {'a pair': Wait(9.9, 'flood'), 'diagnostics': Wait(1.1, 'save')}


def validities(samples=SAMPLES, counts=COUNTS, log=LOG, broken=(), code=0, left=(), waits=WAITS):
    """Return the names of the promises that are broken, by their first two words."""
    run = Run(samples, counts, log, list(broken), code, SimpleNamespace(left=left), waits)
    promises = promises_of(run, LIMITS)
    return [' '.join(one.name.split()[:2]) for one in promises if not one.kept]


def test_a_sound_node_keeps_every_promise():
    assert broken_sums(COUNTS, SENT) == []
    assert validities() == []


@pytest.mark.parametrize('changes, sentence', [
    ({'pairs dropped': 4}, 'do not add up'),
    ({'pairs waiting': 1}, 'do not add up'),
    ({'refused: size': 1}, 'refused by reason are 2, in all 3'),
    ({'received left/image_rect': 29, 'unmatched left/image_rect': 1},
     'left/image_rect: 30 sent, 29 received, 0 lost'),
    ({'lost left/image_rect': 1}, 'left/image_rect: 30 sent, 30 received, 1 lost'),
    ({'unmatched right/camera_info': 3}, 'right/camera_info: 30 received, but 3 unmatched'),
    ({'received left/camera_info': 38, 'unmatched left/camera_info': 4}, '30 sent, 38 received'),
])
def test_a_count_that_is_wrong_is_told(changes, sentence):
    assert sentence in '; '.join(broken_sums({**COUNTS, **changes}, SENT))


def test_what_waits_for_others_is_not_lost_but_never_more_than_the_queue():
    sent = dict.fromkeys(TOPICS, 35)
    received = {f'received {topic}': 35 for topic in TOPICS}
    assert broken_sums({**COUNTS, **received}, sent) == []
    assert len(broken_sums({**COUNTS, **received, 'queue_size': 4}, sent)) == len(TOPICS)


def test_a_message_that_the_middleware_lost_counts_and_needs_its_line():
    counts = {**COUNTS, 'lost left/image_rect': 3, 'received left/image_rect': 30}
    assert broken_sums(counts, {**SENT, 'left/image_rect': 33}) == []
    line = '[INFO] [1.0] [disparity_node]: since the last report: lost left/image_rect 3; they'
    assert validities(counts=counts) == ['every loss']
    assert validities(counts=counts, log=f'{LOG}\n{line}') == []


def test_the_losses_that_lines_tell_are_added_up():
    assert losses_told(LOG) == {
        'pairs dropped': 5, 'pairs refused': 3, **{f'unmatched {topic}': 2 for topic in TOPICS}}


@pytest.mark.parametrize('place', [1, 3, 4, 5])
def test_a_loss_without_its_line_breaks_a_promise(place):
    lines = LOG.splitlines()
    del lines[place]
    assert validities(log='\n'.join(lines)) == ['every loss']


@pytest.mark.parametrize('line', [
    'Traceback (most recent call last):', '[FATAL] [1.0] [disparity_node]: kernel warm-up failed',
    '[ERROR] [1.0] [disparity_node]: cannot be prepared: disparity_range'])
def test_a_fault_in_the_log_breaks_a_promise(line):
    assert validities(log=f'{LOG}\n{line}') == ['nothing is']


def test_a_pair_lost_by_a_fault_of_the_package_breaks_a_promise():
    line = '[ERROR] [1.0] [disparity_node]: pair refused: internal error: KeyError'
    assert validities(log=f'{LOG}\n{line}') == ['nothing is']


@pytest.mark.parametrize('last, broken', [
    (Sample(100.9, 9080, 157.0, 90.0, 2.9, 23.0), []),
    (Sample(101.1, 9000, 150.0, 25.0, 2.0, 20.0), ['memory in']),
    (Sample(100.0, 9100, 150.0, 25.0, 2.0, 20.0), ['memory in']),
    (Sample(100.0, 9000, 158.0, 25.0, 2.0, 20.0), ['resident memory']),
    (Sample(100.0, 9000, 150.0, 25.0, 3.1, 20.0), ['latency grows']),
    (Sample(100.0, 9000, 150.0, 25.0, 2.0, 25.0), ["a pair's"])])
def test_what_grows_more_than_it_may_breaks_a_promise(last, broken):
    assert validities(samples=[*SAMPLES, last, last, last]) == broken


def test_a_thread_that_is_left_over_and_a_long_wait_break_promises():
    assert validities(left=['python (since save)']) == ['no thread']
    for what in WAITS:
        assert validities(waits={**WAITS, what: Wait(10.0, 'flood')}) == ['nobody waits']


def test_the_longest_waits_are_between_what_was_sent_first_and_its_answer(monkeypatch):
    now = iter([100.0, 101.0, 107.0])
    monkeypatch.setattr('soak_waits.time.time', lambda: next(now))
    waits = Waits()
    waits.sent(1)
    waits.sent(2)
    waits.sent(1)
    waits.event = 'flood'
    waits.answered(1, 102_500_000_000)
    waits.event = 'save'
    waits.answered(2, 102_000_000_000)
    waits.answered(1, 150_000_000_000)      # again, and of a stamp that nobody has sent
    waits.answered(7, 150_000_000_000)
    assert waits.longest['a pair'] == Wait(2.5, 'flood')
    for when in (100, 101, 104, 105):
        waits.diagnosed(when * 1_000_000_000)
    assert waits.longest['diagnostics'] == Wait(3.0, 'save')


def test_a_pair_that_is_forgotten_is_not_waited_for():
    waits = Waits()
    waits.sent(1)
    waits.forget()
    waits.answered(1, 2**62)
    assert waits.longest['a pair'].seconds == 0


def test_sums_that_were_broken_and_another_exit_code_break_promises():
    assert validities(broken=['round 3: 30 sent'], code=1) == ['sent =', 'SIGINT ends']


@pytest.mark.parametrize('values', [[4.0, 4.0, 4.0], [2.0, 9.0, 8.0, 1.0, 4.0, 4.0], [3.0, 6.0]])
def test_growth_compares_the_medians_of_the_first_and_the_last_third(values):
    third = {2: 1, 3: 1, 6: 2}[len(values)]
    first, last = sorted(values[:third]), sorted(values[-third:])
    assert growth(values) == pytest.approx(100 * (sum(last) / sum(first) - 1))


def test_a_spread_is_the_least_the_most_and_the_usual_distance_from_the_median():
    assert spread([10.0, 11.0, 12.0, 13.0, 90.0], 1) == '10.0 to 90.0 (+-1.0)'


@contextmanager
def running(times=1):
    """Have threads in this process; give {id: name} of them."""
    end = threading.Event()
    threads = [threading.Thread(target=end.wait, name='waits') for _ in range(times)]
    for thread in threads:
        thread.start()
    try:
        yield {thread.native_id: thread.name for thread in threads}
    finally:
        end.set()
        for thread in threads:
            thread.join()
        while threads_of(os.getpid()).keys() & {thread.native_id for thread in threads}:
            os.sched_yield()    # the system's thread ends a little after Python's


def test_a_thread_that_comes_later_is_left_over_with_its_name_and_since_when():
    threads = Threads(os.getpid())
    assert threads.left_over({}) == threads.left == []
    before = len(threads_of(os.getpid()))
    with running() as names:
        assert threads_of(os.getpid()).keys() >= names.keys()
        threads.note('save')
        threads.note('reset')
        assert threads.left_over(names) == threads.left == ['waits (since save)']
        with running() as more:
            threads.note('flood')
            assert 'left over: 1 x waits (since save)' in str(threads)
            assert threads.left_over({**names, **more}) == [
                'waits (since save)', 'waits (since flood)']
    assert threads.left_over({}) == []
    assert str(threads) == f'{before}, up to {before + 2} after events; left over: none'


def test_a_thread_that_takes_the_place_of_another_is_not_left_over():
    threads = Threads(os.getpid())
    with running(2) as first:
        threads.left_over({number: f'{name}-1_0' for number, name in first.items()})
    with running(2) as second:
        assert threads.left_over({number: f'{name}-20_1' for number, name in second.items()}) == []
