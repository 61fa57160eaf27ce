# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The worker: the newest pair wins, every pair is counted, an exception is survived."""
from queue import SimpleQueue
import threading

from fuzzy_stereo_ros.node.worker import Worker
import pytest

SOON = 60.0     # s; nothing here takes long, events are awaited: when to give up


class Bench:
    """A worker that waits for a permit for each item, None or an error, and notes events."""

    def __init__(self):
        self.started, self.permits, self.failures = SimpleQueue(), SimpleQueue(), SimpleQueue()
        self.worker = Worker(
            lambda: self.work('begin'), self.work, lambda *failure: self.failures.put(failure))

    def work(self, item):
        self.started.put((item, threading.current_thread().name))
        error = self.permits.get(timeout=SOON)
        if error is not None:
            raise error

    def begun(self):
        return self.started.get(timeout=SOON)

    def settled(self):
        """Return the counts when nothing is worked on any more."""
        assert self.worker.close(SOON)
        return self.worker.counts()


@pytest.fixture
def bench():
    bench = Bench()
    assert bench.begun() == ('begin', 'worker')
    yield bench
    for _ in range(3):
        bench.permits.put(None)
    assert bench.worker.close(timeout=SOON)


def counts(submitted, done=0, failed=0, dropped=0, pending=0):
    return {'submitted': submitted, 'done': done, 'failed': failed, 'dropped': dropped,
            'pending': pending}


def test_it_begins_before_the_first_pair_and_the_newest_of_those_that_wait_wins(bench):
    for item in range(4):
        bench.worker.submit(item)
    assert bench.worker.counts() == counts(4, dropped=3, pending=1)
    bench.permits.put(None)
    assert bench.begun() == (3, 'worker')
    for item in (4, None):
        bench.worker.submit(item)
    assert bench.worker.counts() == counts(6, dropped=4, pending=2)
    bench.permits.put(None)
    assert bench.begun() == (None, 'worker')
    bench.permits.put(None)
    assert bench.settled() == counts(6, done=2, dropped=4)


def test_an_exception_is_reported_with_its_pair_and_survived(bench):
    bench.permits.put(RuntimeError('no kernels'))
    begin, error = bench.failures.get(timeout=SOON)
    assert (begin, str(error)) == (None, 'no kernels')
    bench.permits.put(ValueError('no good'))
    bench.worker.submit('bad')
    item, error = bench.failures.get(timeout=SOON)
    assert (item, str(error)) == ('bad', 'no good')
    bench.begun()
    bench.worker.submit('good')
    assert bench.begun() == ('good', 'worker')
    bench.permits.put(None)
    assert bench.settled() == counts(2, done=1, failed=1)


def test_closing_waits_for_the_pair_in_work_and_drops_what_waits_and_what_comes(bench):
    bench.permits.put(None)
    bench.worker.submit(0)
    assert bench.begun() == (0, 'worker')
    bench.worker.submit(1)
    assert not bench.worker.close(timeout=0.01)
    bench.permits.put(None)
    assert bench.worker.close(timeout=SOON)
    bench.worker.submit(2)
    assert bench.worker.counts() == counts(3, done=1, dropped=2)
