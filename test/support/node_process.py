# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A node of this package as a process in a domain of its own; imports no ROS."""
from contextlib import contextmanager
import fcntl
from itertools import cycle, islice
import os
from pathlib import Path
import signal
import subprocess
import sys
import tempfile
import threading

from repository import ROOT

DISPARITY_NODE = 'fuzzy_stereo_ros.node.disparity_node'
DOMAINS = range(1, 101)     # those whose ports lie below Linux's ephemeral ones
# One is used again as late as can be: what is left of an earlier node would be in its graph. Each
# process of a parallel run begins elsewhere.
_WORKER = int(os.environ.get('PYTEST_XDIST_WORKER', 'gw0').removeprefix('gw'))
_WORKERS = int(os.environ.get('PYTEST_XDIST_WORKER_COUNT', 1))
_NEXT_DOMAINS = islice(cycle(DOMAINS), _WORKER * len(DOMAINS) // _WORKERS, None)
START = 500.0       # s; the first start on a machine compiles kernels, at worst a busy one
SOON = 60.0         # s; events are awaited, this is only when to give up


@contextmanager
def own_domain():
    """Give a ROS_DOMAIN_ID that no other test on this machine uses meanwhile."""
    folder = Path(tempfile.gettempdir()) / 'fuzzy_stereo_ros_domains'
    folder.mkdir(exist_ok=True)
    for domain in islice(_NEXT_DOMAINS, len(DOMAINS)):
        with open(folder / str(domain), 'w') as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                continue
            yield domain
            return
    raise RuntimeError(f'all domains {DOMAINS} are taken')


def ros_environment(logs):
    """Return the environment variables that tests and their processes need besides a domain."""
    prefixes = [sys.prefix, *filter(None, [os.environ.get('AMENT_PREFIX_PATH')])]
    return {'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST',
            'ROS_LOG_DIR': str(logs),
            'AMENT_PREFIX_PATH': os.pathsep.join(prefixes),
            'FASTRTPS_DEFAULT_PROFILES_FILE': str(ROOT / 'config' / 'fastdds.xml'),
            'PYTHONUNBUFFERED': '1'}


class NodeProcess:
    """The node in a process of its own, with what it logs."""

    def __init__(self, domain, *arguments, module=DISPARITY_NODE, before=()):
        """Start the module's node in a domain; before: words before those of the process."""
        self._news = threading.Condition()
        self._lines, self._ended = [], False
        self._process = subprocess.Popen(
            [*before, sys.executable, '-m', module, *arguments], cwd=ROOT, text=True,
            env={**os.environ, 'ROS_DOMAIN_ID': str(domain)},
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self):
        for line in self._process.stdout:
            with self._news:
                self._lines.append(line.rstrip('\n'))
                self._news.notify_all()
        with self._news:
            self._ended = True
            self._news.notify_all()

    def log(self, after=0):
        """Return all it has logged so far, or since a mark."""
        with self._news:
            return '\n'.join(self._lines[after:])

    def mark(self):
        """Return a place in the log, to look for what comes after it."""
        with self._news:
            return len(self._lines)

    def logged(self, text, after=0, timeout=SOON):
        """Wait for a line that holds a text, after a mark, and return the line."""
        def found():
            return next((line for line in self._lines[after:] if text in line), None)

        with self._news:
            self._news.wait_for(lambda: found() or self._ended, timeout)
            line = found()
        assert line is not None, f'not logged: {text}\n{self.log()}'
        return line

    @property
    def identity(self):
        """The id of the process."""
        return self._process.pid

    def alive(self):
        return self._process.poll() is None

    def send(self, number):
        self._process.send_signal(number)

    def finish(self, number=signal.SIGINT, timeout=SOON):
        """End it with a signal, where it still runs, and return its exit code."""
        if self.alive() and number is not None:
            self.send(number)
        try:
            code = self._process.wait(timeout)
        finally:
            self._process.kill()
            self._reader.join()
            self._process.stdout.close()
        return code
