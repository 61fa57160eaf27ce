# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The thread of the node that matches: the newest pair wins.

`PairMatcher` warms up kernels in another thread meanwhile, so no kernel may be parallel: numba's
`workqueue` layer aborts a process in which two Python threads call parallel kernels.
"""
import threading


class Worker:
    """Processes the newest item in a thread; submitted = done + failed + dropped + pending."""

    def __init__(self, begin, work, on_error):
        """Start with begin(), then work(item); on_error(item, error): of both; in the thread."""
        self._begin, self._work, self._on_error = begin, work, on_error
        self._wake = threading.Condition()
        self._waiting, self._closed = [], False
        self._counts = dict.fromkeys(('submitted', 'done', 'failed', 'dropped'), 0)
        self._thread = threading.Thread(target=self._run, name='worker', daemon=True)
        self._thread.start()

    def submit(self, item):
        """Make an item the next one; an item that still waits is dropped and counted."""
        with self._wake:
            self._counts['submitted'] += 1
            self._counts['dropped'] += self._closed or len(self._waiting)
            if not self._closed:
                self._waiting = [item]
                self._wake.notify_all()

    def counts(self):
        """Return {name: number} of submitted, done, failed, dropped and pending items."""
        with self._wake:
            submitted, *ended = self._counts.values()
            return {**self._counts, 'pending': submitted - sum(ended)}

    def close(self, timeout=None):
        """Drop the waiting item and end the thread; return whether it ended in time, s."""
        with self._wake:
            self._closed = True
            self._counts['dropped'] += len(self._waiting)
            self._waiting = []
            self._wake.notify_all()
        self._thread.join(timeout)
        return not self._thread.is_alive()

    def _run(self):
        self._attempt(self._begin)
        while True:
            with self._wake:
                self._wake.wait_for(lambda: self._waiting or self._closed)
                if self._closed:
                    return
                item = self._waiting.pop()
            done = self._attempt(self._work, item)
            with self._wake:
                self._counts['done' if done else 'failed'] += 1

    def _attempt(self, call, *items):
        """Return whether a call succeeds; hand its exception to on_error if not."""
        try:
            call(*items)
        except Exception as error:      # noqa: B902  the thread must survive any error
            self._on_error(*(items or (None,)), error)
            return False
        return True
