# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The worker: newest pair wins, everything is counted, an exception is survived."""
from queue import SimpleQueue
import threading

from fuzzy_stereo_ros.node.worker import Worker
import pytest

SOON = 60.0     # s; nothing here takes long, events are awaited: when to give up


class Bench:
    """A lane whose work waits for a permit for each pair and notes what it was given."""

    def __init__(self, worker):
        self.started, self.permits, self.failures = SimpleQueue(), SimpleQueue(), SimpleQueue()
        self.lane = worker.open_lane(self.work, lambda *failure: self.failures.put(failure))

    def work(self, pair):
        self.started.put((pair, threading.current_thread().name))
        error = self.permits.get(timeout=SOON)
        if error is not None:
            raise error

    def begun(self):
        return self.started.get(timeout=SOON)[0]


@pytest.fixture
def worker():
    worker = Worker()
    yield worker
    assert worker.stop(timeout=SOON)


def settle(worker):
    """Return when the worker has finished all it was given so far."""
    done = threading.Event()
    lane = worker.open_lane(lambda pair: done.set(), None)
    lane.offer('last')
    assert done.wait(SOON)
    worker.close_lane(lane)


def test_newest_pair_wins_and_the_dropped_are_counted(worker):
    bench = Bench(worker)
    bench.lane.offer(0)
    assert bench.begun() == 0
    for pair in (1, 2, 3):
        bench.lane.offer(pair)
    assert bench.lane.counts() == {
        'offered': 4, 'done': 0, 'failed': 0, 'dropped': 2, 'pending': 2}
    bench.permits.put(None)
    assert bench.begun() == 3
    bench.permits.put(None)
    settle(worker)
    assert bench.lane.counts() == {
        'offered': 4, 'done': 2, 'failed': 0, 'dropped': 2, 'pending': 0}


def test_offering_does_not_wait_for_the_work(worker):
    bench = Bench(worker)
    bench.lane.offer(0)
    bench.begun()
    for pair in range(1000):
        bench.lane.offer(pair)
    assert bench.lane.counts()['dropped'] == 999
    bench.permits.put(None)
    bench.permits.put(None)


def test_an_exception_is_reported_with_its_pair_and_survived(worker):
    bench = Bench(worker)
    bench.permits.put(ValueError('no good'))
    bench.lane.offer('bad')
    pair, error = bench.failures.get(timeout=SOON)
    assert (pair, str(error)) == ('bad', 'no good')
    bench.permits.put(None)
    bench.lane.offer('good')
    settle(worker)
    assert bench.lane.counts() == {
        'offered': 2, 'done': 1, 'failed': 1, 'dropped': 0, 'pending': 0}


@pytest.mark.filterwarnings('ignore::pytest.PytestUnhandledThreadExceptionWarning')
def test_a_report_that_raises_does_not_end_the_worker(worker):
    told = threading.Event()

    def report(pair, error):
        told.set()
        raise RuntimeError('the report is broken as well')

    def work(pair):
        raise ValueError('no good')

    lane = worker.open_lane(work, report)
    lane.offer('bad')
    assert told.wait(SOON)
    settle(worker)
    assert lane.counts()['failed'] == 1


def test_a_none_pair_is_a_pair(worker):
    seen = SimpleQueue()
    lane = worker.open_lane(seen.put, None)
    lane.offer(None)
    assert seen.get(timeout=SOON) is None


def test_two_lanes_are_served_in_turn_by_one_thread(worker):
    order = SimpleQueue()
    gate = threading.Event()

    def make(name):
        def work(pair):
            gate.wait(SOON)
            order.put((name, pair, threading.current_thread().name))
        return work

    first, second = worker.open_lane(make('a'), None), worker.open_lane(make('b'), None)
    first.offer(0)
    second.offer(0)
    second.offer(1)
    gate.set()
    seen = [order.get(timeout=SOON) for _ in range(2)]
    assert sorted(name for name, _, _ in seen) == ['a', 'b']
    assert ('b', 1, 'worker') in seen
    assert {thread for _, _, thread in seen} == {'worker'}


def test_a_call_runs_before_the_waiting_pair_and_is_not_a_pair(worker):
    bench, order = Bench(worker), SimpleQueue()
    bench.lane.offer(0)
    bench.begun()
    lane = worker.open_lane(lambda pair: order.put(pair), None)
    lane.offer('pair')
    lane.call(lambda: order.put('task'))
    bench.permits.put(None)
    assert [order.get(timeout=SOON) for _ in range(2)] == ['task', 'pair']
    assert lane.counts()['offered'] == 1


def test_a_call_that_raises_is_reported_without_a_pair(worker):
    failures = SimpleQueue()
    lane = worker.open_lane(None, lambda *failure: failures.put(failure))
    lane.call(lambda: 1 / 0)
    pair, error = failures.get(timeout=SOON)
    assert pair is None
    assert isinstance(error, ZeroDivisionError)


def test_closing_a_lane_waits_for_its_work_and_drops_what_waits(worker):
    bench = Bench(worker)
    bench.lane.offer(0)
    bench.begun()
    bench.lane.offer(1)
    closer = threading.Thread(target=worker.close_lane, args=(bench.lane,))
    closer.start()
    bench.permits.put(None)
    closer.join(SOON)
    assert not closer.is_alive()
    bench.lane.offer(2)
    assert bench.lane.counts() == {
        'offered': 3, 'done': 1, 'failed': 0, 'dropped': 2, 'pending': 0}


def test_stop_ends_the_thread_after_the_pair_in_work():
    worker = Worker()
    bench = Bench(worker)
    bench.lane.offer(0)
    bench.begun()
    bench.lane.offer(1)
    assert not worker.stop(timeout=0.01)
    bench.permits.put(None)
    assert worker.stop(timeout=SOON)
    assert bench.lane.counts() == {
        'offered': 2, 'done': 1, 'failed': 0, 'dropped': 1, 'pending': 0}
    assert worker.stop(timeout=SOON)


def test_a_process_has_one_worker_until_it_is_stopped():
    shared = Worker.of_this_process()
    assert Worker.of_this_process() is shared
    assert shared.stop(timeout=SOON)
    renewed = Worker.of_this_process()
    assert renewed is not shared
    assert renewed.stop(timeout=SOON)
