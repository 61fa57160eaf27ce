# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Compile the kernels that a matcher needs, in as many processes as there are cores.

A dry run of the warm-up, in a process of its own, finds which kernels are called with which types:
a recorder, which computes nothing, replaces each kernel. In some rounds recorders write random
numbers into the arrays that they get, so that the matcher takes all of its branches. A kernel that
the dry run misses is compiled by the warm-up itself.
"""
from concurrent.futures import as_completed, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import asdict, replace
import json
import os
from queue import SimpleQueue
import subprocess
import sys
import threading
import time
from typing import NamedTuple
import warnings

from fuzzy_stereo_ros.matching.config import MatcherConfig
from fuzzy_stereo_ros.matching.kernels.compiled import before_compiling, FOLDER
from fuzzy_stereo_ros.matching.matcher import warm_up_camera, warm_up_pairs
from numba.core.dispatcher import Dispatcher
import numpy as np

PACKAGE = __name__.rpartition('.')[0]
# of a dry run: the seed of what recorders write, None for nothing; whether a camera is followed
ROUNDS = (None, True), *((seed, follows) for seed in range(2) for follows in (True, False))
# level of LLVM, unless the user sets it: kernels are as fast as at 3, and compiled sooner
OPTIMISATION = {'NUMBA_OPT': '2'}
START = 'import sys; sys.path[:] = {!r}; from {} import serve; serve()'


class Progress(NamedTuple):
    """Progress of compiling; share: 0 to 1, of the code; left: seconds, None if unknown."""

    share: float
    left: float | None


def warm_up(matcher, rows, columns, report=None):
    """
    Warm a StereoMatcher up; all cores compile the kernels that are not cached.

    report(Progress): called in the thread of this call, and only where something is compiled.
    Raises ValueError for a size that cannot be matched.
    """
    if FOLDER is None:
        matcher.warm_up(rows, columns)
        return
    with before_compiling(lambda: compile_kernels(matcher.config, report)):
        matcher.warm_up(rows, columns)


def compile_kernels(config, report=None):
    """Compile into FOLDER what matchers of a MatcherConfig need; report: as in `warm_up`."""
    report = report or (lambda progress: None)
    report(Progress(0.0, None))
    with Workers(len(os.sched_getaffinity(0)), config) as workers:
        sizes = {call: _size(_kernel(*call[:2]), set())
                 for call in map(tuple, workers.request(None) or ())}
        begun, done, threads = time.monotonic(), 0, ThreadPoolExecutor(workers.number)
        futures = {threads.submit(workers.request, call): call
                   for call in sorted(sizes, key=sizes.get, reverse=True)}
        try:
            for future in as_completed(futures):
                done += sizes[futures[future]]
                share = done / sum(sizes.values())
                report(Progress(share, (time.monotonic() - begun) * (1 / share - 1)))
        finally:
            threads.shutdown(wait=False, cancel_futures=True)
    report(Progress(1.0, 0.0))


def record_calls(config):
    """Return the calls of a warm-up: {(module, name, types of arguments in words): the types}."""
    noted, config = {}, replace(config, threads=1)
    for seed, follows in ROUNDS:
        with _recording(noted, seed), warnings.catch_warnings(), np.errstate(all='ignore'):
            warnings.simplefilter('ignore')
            for matcher, left, right in warm_up_pairs(config):
                with suppress(Exception):       # random numbers may break what follows
                    matcher.match(left, right, camera=warm_up_camera(left) if follows else None)
    return noted


def compile_call(call, types):
    """Compile a kernel for a call of `record_calls`, and keep it."""
    _kernel(*call[:2]).compile(types)


def serve():
    """
    Run a process of Workers: record the calls, then compile on request, until stdin ends.

    It reads lines of JSON: a MatcherConfig, then requests. It answers null with the recorded
    calls, and a call with whether it is compiled.
    """
    requests, answers = SimpleQueue(), os.fdopen(os.dup(1), 'w')
    os.dup2(2, 1)       # prints go to stderr, not among the answers

    def read():
        for line in sys.stdin:
            requests.put(json.loads(line))
        os._exit(0)     # the requesting process has ended: a compilation cannot be interrupted

    threading.Thread(target=read, daemon=True).start()
    calls = record_calls(MatcherConfig(**requests.get()))
    while True:
        call, answer = requests.get(), list(calls)
        if call is not None:
            try:
                compile_call(call, calls[tuple(call)])
                answer = True
            except Exception:       # noqa: B902  the warm-up meets the same error and raises it
                answer = False
        answers.write(json.dumps(answer) + '\n')
        answers.flush()


class Workers:
    """Processes that compile kernels; a context manager that ends them."""

    def __init__(self, number, config):
        """Start a number of processes for what a MatcherConfig needs."""
        self.number, self._config, self._ended = number, json.dumps(asdict(config)), False
        self._processes, self._free = [self._started() for _ in range(number)], SimpleQueue()
        for place in range(number):
            self._free.put(place)

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self._ended = True
        for process in self._processes:
            _end(process)

    def request(self, call):
        """
        Return whether a free process compiled a call; for None the list of recorded calls.

        Return None where the process ends; another one then takes its place.
        """
        place = self._free.get()
        process = self._processes[place]
        try:
            process.stdin.write(json.dumps(call) + '\n')
            process.stdin.flush()
            return json.loads(process.stdout.readline())
        except (OSError, ValueError):
            if not self._ended:
                _end(process)
                self._processes[place] = self._started()
            return None
        finally:
            self._free.put(place)

    def _started(self):
        """Start a process, in a session of its own so that Ctrl-C does not reach it."""
        process = subprocess.Popen(
            [sys.executable, '-c', START.format(sys.path, __name__)], text=True,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, start_new_session=True,
            env=OPTIMISATION | os.environ)
        process.stdin.write(self._config + '\n')
        process.stdin.flush()
        return process


def _end(process):
    process.kill()
    with suppress(OSError), process:    # closing flushes a pipe that nobody reads
        pass


@contextmanager
def _recording(noted, seed):
    """Replace each kernel that a module of the matcher imports by a recorder."""
    numbers = None if seed is None else np.random.default_rng(seed)
    replaced = [(module, name, value) for module in list(sys.modules.values())
                if module.__name__.startswith(PACKAGE)
                for name, value in vars(module).items() if isinstance(value, Dispatcher)]
    for module, name, value in replaced:
        setattr(module, name, _Recorder(value, noted, numbers))
    try:
        yield
    finally:
        for module, name, value in replaced:
            setattr(module, name, value)


class _Recorder:
    """Takes the place of a kernel: records the types of arguments, returns 1 or a random bit."""

    def __init__(self, kernel, noted, numbers):
        self._kernel, self._noted, self._numbers = kernel, noted, numbers

    def __call__(self, *arguments):
        function = self._kernel.py_func
        types = tuple(map(self._kernel.typeof_pyval, arguments))
        self._noted[function.__module__, function.__qualname__, repr(types)] = types
        if self._numbers is None:
            return _Answer(1)
        self._fill(arguments)
        return _Answer(self._numbers.integers(4) > 0)

    def _fill(self, arguments):
        """Write random numbers into the arrays among the arguments, small or large ones."""
        for one in arguments:
            if isinstance(one, tuple):
                self._fill(one)
            elif isinstance(one, np.ndarray) and one.flags.writeable:
                most = 4.0**self._numbers.integers(1, 3)
                one[...] = (self._numbers.integers(0, 32, one.shape) if one.dtype.kind in 'iub'
                            else self._numbers.uniform(0, most, one.shape))


class _Answer(int):
    """A number that unpacks into two, since kernels return one number or two."""

    def __iter__(self):
        return iter((self, self))


def _kernel(module, name):
    """Return a kernel by its module and name."""
    return getattr(sys.modules[module], name)


def _size(kernel, seen):
    """Return the size of a kernel's code in bytes, with that of all that it calls."""
    seen.add(kernel)
    code, names = kernel.py_func.__code__, kernel.py_func.__globals__
    called = {one for one in map(names.get, code.co_names) if isinstance(one, Dispatcher)} - seen
    return len(code.co_code) + sum(_size(one, seen) for one in called if one not in seen)
