# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Ctrl-C as something to be looked at between two pieces of work, and SIGTERM as Ctrl-C."""
from contextlib import contextmanager
import signal
import threading


class Interruption:
    """
    A context manager in which SIGINT is only noted; a second one raises KeyboardInterrupt.

    Outside the main thread, where Python allows no handlers, nothing is noted.
    """

    def __init__(self):
        self._came, self._before = False, None

    def __enter__(self):
        if threading.current_thread() is threading.main_thread():
            self._before = signal.signal(signal.SIGINT, self._note)
        return self

    def __exit__(self, *error):
        if self._before is not None:
            signal.signal(signal.SIGINT, self._before)

    def came(self):
        """Return whether SIGINT has come."""
        return self._came

    def _note(self, number, frame):
        if self._came:
            raise KeyboardInterrupt
        self._came = True


@contextmanager
def undisturbed():
    """Let SIGINT do nothing, as while what must not be left half done is ended."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


@contextmanager
def terminated_as_by_hand():
    """
    Let SIGTERM, as a service or a container is stopped by, do what Ctrl-C does.

    Yields a function that returns whether it came. Where Ctrl-C does nothing, as in the
    background of a script, SIGTERM still ends the process at once.
    """
    came = []

    def interrupt(number, frame):
        came.append(number)
        signal.raise_signal(signal.SIGINT)

    if (threading.current_thread() is not threading.main_thread()
            or signal.getsignal(signal.SIGINT) is signal.SIG_IGN):
        yield lambda: False
        return
    before = signal.signal(signal.SIGTERM, interrupt)
    try:
        yield lambda: bool(came)
    finally:
        signal.signal(signal.SIGTERM, before)
