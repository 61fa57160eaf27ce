# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The one thread of a process that calls kernels, shared by all rigs in it, the newest pair first.

All matching of a process goes through `Worker.of_this_process()`. Beside it `preparation.py` warms
kernels up: no kernel may be parallel, as numba's `workqueue` layer aborts the process when two
Python threads call such ones.
"""
from collections import deque
import threading


class Worker:
    """A thread that serves lanes in turn; it ends with `stop`, and never by an exception."""

    _shared = None
    _shared_lock = threading.Lock()

    @classmethod
    def of_this_process(cls):
        """Return the worker that all of this process share; a stopped one is replaced."""
        with cls._shared_lock:
            if cls._shared is None or cls._shared.stopping:
                cls._shared = cls()
            return cls._shared

    def __init__(self):
        self._wake = threading.Condition()
        self._lanes = deque()
        self._thread = threading.Thread(target=self._run, name='worker', daemon=True)
        self.stopping = False
        self._thread.start()

    def open_lane(self, work, failed):
        """
        Return a new Lane.

        work(pair): called in the worker's thread. failed(pair, error): called there when work
        raised the exception; the pair is lost, the lane goes on.
        """
        lane = Lane(self._wake, work, failed)
        with self._wake:
            self._lanes.append(lane)
        return lane

    def close_lane(self, lane, timeout=None):
        """
        Forget a lane and drop what waits in it; return whether nothing of it runs any more.

        timeout: s to wait for what runs; None = until done.
        """
        with self._wake:
            lane.close()
            if lane in self._lanes:
                self._lanes.remove(lane)
            return self._wake.wait_for(lambda: not lane.busy, timeout)

    def stop(self, timeout=None):
        """
        End the thread after what it is doing, drop what waits, and return whether it has ended.

        timeout: s to wait for what it is doing; None = until done.
        """
        with self._wake:
            self.stopping = True
            for lane in self._lanes:
                lane.close()
            self._wake.notify_all()
        self._thread.join(timeout)
        return not self._thread.is_alive()

    def _run(self):
        while True:
            with self._wake:
                self._wake.wait_for(
                    lambda: self.stopping or any(lane.waiting for lane in self._lanes))
                if self.stopping:
                    return
                while not self._lanes[0].waiting:
                    self._lanes.rotate(-1)
                lane = self._lanes[0]
                self._lanes.rotate(-1)
                task, pair = lane.take()
            lane.perform(task, pair)
            with self._wake:
                lane.busy = False
                self._wake.notify_all()


class Lane:
    """
    The place of one rig at the worker: at most one pair waits, a newer one takes its place.

    offered = done + failed + dropped + (1 if one waits) + (1 while one is worked on).
    """

    def __init__(self, wake, work, failed):
        self.offered = self.done = self.failed = self.dropped = 0
        self.busy = False
        self._wake = wake
        self._work, self._report = work, failed
        self._tasks, self._pair, self._closed = deque(), None, False

    @property
    def waiting(self):
        """Whether there is something to do."""
        return bool(self._tasks) or self._pair is not None

    def offer(self, pair):
        """Leave a pair to be worked on next; one that still waits is dropped and counted."""
        with self._wake:
            self.offered += 1
            if self._pair is not None or self._closed:
                self.dropped += 1
            if not self._closed:
                self._pair = (pair,)
                self._wake.notify_all()

    def call(self, task):
        """Have task() called in the worker's thread, before any pair that waits."""
        with self._wake:
            if not self._closed:
                self._tasks.append(task)
                self._wake.notify_all()

    def counts(self):
        """Return offered, done, failed, dropped and pending, which add up at any moment."""
        with self._wake:
            pending = self.offered - self.done - self.failed - self.dropped
            return {'offered': self.offered, 'done': self.done, 'failed': self.failed,
                    'dropped': self.dropped, 'pending': pending}

    def close(self):
        """Drop and count what waits, and take nothing more; the worker's lock is held."""
        self._closed = True
        self._tasks.clear()
        if self._pair is not None:
            self._pair = None
            self.dropped += 1

    def take(self):
        """Return what to do next as (task, None) or (None, pair); the worker's lock is held."""
        self.busy = True
        if self._tasks:
            return self._tasks.popleft(), None
        (pair,), self._pair = self._pair, None
        return None, pair

    def perform(self, task, pair):
        """Do what was taken, and count and report how a pair ended."""
        try:
            if task is not None:
                task()
            else:
                self._work(pair)
        except Exception as error:      # noqa: B902  whatever it is, the next pair is matched
            self._tell(pair, error)
            self._count('failed', task)
        else:
            self._count('done', task)

    def _count(self, how, task):
        if task is None:
            with self._wake:
                setattr(self, how, getattr(self, how) + 1)

    def _tell(self, pair, error):
        try:
            self._report(pair, error)
        except Exception as broken:     # noqa: B902  a failing report must not end the thread
            threading.excepthook(threading.ExceptHookArgs(
                (type(broken), broken, broken.__traceback__, threading.current_thread())))
