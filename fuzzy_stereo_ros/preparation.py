# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What takes long to make, made in a thread of its own while what there is goes on."""
import threading

PREPARING, READY, FAILED = 'being prepared', 'from the next pair on', 'cannot be prepared'


class Preparation:
    """
    Makes what was asked for last; a newer wish takes the place of all before it.

    state: '' before the first wish and when it was taken, else PREPARING, READY or FAILED.
    """

    def __init__(self, make, told):
        """
        Begin with no wish.

        make(wish): called in a thread, one at a time; returns what take() gives. told(wish,
        error): called there when take() has it, with None, or when make raised the exception.
        """
        self._make, self._told = make, told
        self._lock = threading.Lock()
        self._wish, self._made, self._thread, self._closed = None, None, None, False
        self.state = ''

    def ask(self, wish):
        """Have something made; what was made for an older wish and is not taken is dropped."""
        with self._lock:
            if self._closed:
                return
            self._wish, self._made, self.state = (wish,), None, PREPARING
            if self._thread is None:
                self._thread = threading.Thread(
                    target=self._run, name='preparation', daemon=True)
                self._thread.start()

    def take(self):
        """Return what was made for the newest wish, once; None where there is nothing yet."""
        with self._lock:
            made, self._made = self._made, None
            if made is not None:
                self.state = ''
            return made

    def close(self, timeout=None):
        """
        Drop all wishes and return whether nothing is being made any more.

        timeout: s to wait for what is being made; None = until done.
        """
        with self._lock:
            self._closed, self._wish, self._made = True, None, None
            thread = self._thread
        if thread is not None:
            thread.join(timeout)
        return thread is None or not thread.is_alive()

    def _run(self):
        while True:
            with self._lock:
                if self._wish is None:
                    self._thread = None
                    return
                (wish,), self._wish = self._wish, None
            made, error = None, None
            try:
                made = self._make(wish)
            except Exception as fault:      # noqa: B902  whatever it is, what there is goes on
                error = fault
            with self._lock:
                if self._wish is not None or self._closed:
                    continue        # nobody wants it any more
                self._made, self.state = made, READY if error is None else FAILED
            self._told(wish, error)
