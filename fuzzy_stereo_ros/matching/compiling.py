# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Compile the kernels that a matcher needs, in as many processes as there are cores.

Each process finds by a dry run of the warm-up which kernels are called with which types: a
recorder, which computes nothing, replaces each kernel. In some rounds recorders write random
numbers into the arrays that they get, so that the matcher takes all of its branches. A kernel that
the dry run misses, or whose process ends, is compiled by the warm-up itself.
"""
from contextlib import contextmanager, suppress
from dataclasses import asdict, replace
from functools import partial
import gc
import json
import os
import subprocess
import sys
import threading
import time
from typing import NamedTuple
import warnings

from fuzzy_stereo_ros.matching.config import MatcherConfig
from fuzzy_stereo_ros.matching.kernels.compiled import before_compiling, FOLDER
from fuzzy_stereo_ros.matching.matcher import warm_up_camera, warm_up_pairs
from numba.extending import is_jitted
import numpy as np

PACKAGE = __name__.rpartition('.')[0]
# of a dry run: the seed of what recorders write, None for nothing; whether a camera is followed
ROUNDS = (None, True), (0, True), (0, False)
# level of LLVM, unless the user sets it: kernels are as fast as at 3, and compiled sooner
OPTIMISATION = {'NUMBA_OPT': '2'}
START = 'import sys; sys.path[:] = {!r}; from {} import serve; serve(*sys.argv[1:])'
MOST = 4096     # calls; their numbers wait in a pipe, two bytes each


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
    report, begun, done = report or (lambda progress: None), None, 0
    with _workers(config) as lines:
        report(Progress(0.0, None))
        for size, total in (map(int, line.split()) for line in lines):
            begun, done = begun or time.monotonic(), done + size
            if size:
                left = (time.monotonic() - begun) * (total / done - 1)
                report(Progress(done / total, left))
    report(Progress(1.0, 0.0))


@contextmanager
def _workers(config):
    """
    Start a process of `serve` for each core, end them at last; yield the lines that they write.

    Each is in a session of its own, so that Ctrl-C does not reach it.
    """
    queue, numbers = os.pipe()
    answers, answer = os.pipe()
    os.write(numbers, np.arange(MOST, dtype='<u2').tobytes())
    os.close(numbers)
    words = (sys.executable, '-c', START.format(sys.path, __name__), json.dumps(asdict(config)),
             str(queue), str(answer))
    processes = [
        subprocess.Popen(words, stdin=subprocess.PIPE, stdout=2, start_new_session=True,
                         pass_fds=(queue, answer), env=OPTIMISATION | os.environ)
        for _ in os.sched_getaffinity(0)]
    os.close(queue)
    os.close(answer)
    try:
        with os.fdopen(answers) as lines:
            yield lines
    finally:
        for process in processes:
            process.kill()
            process.communicate()


def serve(config, queue, answers):
    """
    Compile the calls whose numbers are in a pipe; write a line of (size, size of all) for each.

    config: a MatcherConfig in JSON; queue and answers: file descriptors. All processes record the
    same calls in the same order, the largest first.
    """
    threading.Thread(target=_end_with_parent, daemon=True).start()
    gc.disable()    # it would search all that numba keeps: a fifth of the time
    calls = record_calls(MatcherConfig(**json.loads(config)))
    sizes = {call: _size(_kernel(*call[:2]), set()) for call in calls}
    ordered, size = sorted(calls, key=sizes.get, reverse=True), 0
    while True:
        os.write(int(answers), f'{size} {sum(sizes.values())}\n'.encode())
        number = int.from_bytes(os.read(int(queue), 2), 'little')
        if number >= len(ordered):
            return
        call, size = ordered[number], sizes[ordered[number]]
        with suppress(Exception):       # the warm-up meets the same error and raises it
            compile_call(call, calls[call])


def _end_with_parent():
    """End this process when the parent's end of stdin closes: compiling cannot be interrupted."""
    sys.stdin.read()
    os._exit(0)


def record_calls(config):
    """Return the calls of a warm-up: {(module, name, types of arguments in words): the types}."""
    config = replace(config, threads=1)
    with _recording() as recorded, warnings.catch_warnings(), np.errstate(all='ignore'):
        warnings.simplefilter('ignore')
        for seed, follows in ROUNDS:
            random = None if seed is None else np.random.default_rng(seed)
            for matcher, left, right in warm_up_pairs(config):
                camera = warm_up_camera(left) if follows else None
                # Random numbers may break a frame; the next one needs it all the same.
                for recorded.random in (random, None):
                    with suppress(Exception):
                        matcher.match(left, right, camera=camera)
                        break
    return recorded.calls


def compile_call(call, types):
    """Compile a kernel for a call of `record_calls`, and keep it."""
    _kernel(*call[:2]).compile(types)


def _kernel(module, name):
    """Return a kernel by its module and name."""
    return getattr(sys.modules[module], name)


def _size(kernel, seen):
    """Return the size of a kernel's code in bytes, with that of all that it calls."""
    seen.add(kernel)
    code, names = kernel.py_func.__code__, kernel.py_func.__globals__
    called = set(filter(is_jitted, map(names.get, code.co_names))) - seen
    return len(code.co_code) + sum(_size(one, seen) for one in called if one not in seen)


@contextmanager
def _recording():
    """Replace the kernels that modules of the matcher import; yield the `_Recorded` calls."""
    recorded = _Recorded()
    replaced = [(module, name, value) for module in list(sys.modules.values())
                if module.__name__.startswith(PACKAGE)
                for name, value in vars(module).items() if is_jitted(value)]
    for module, name, value in replaced:
        setattr(module, name, partial(recorded.call, value))
    try:
        yield recorded
    finally:
        for module, name, value in replaced:
            setattr(module, name, value)


class _Recorded:
    """Takes calls in the place of kernels; random: what it writes into their arrays, or None."""

    def __init__(self):
        self.calls, self.random = {}, None

    def call(self, kernel, *arguments):
        """Record the types of the arguments; return 1, or a random bit."""
        function, types = kernel.py_func, tuple(map(kernel.typeof_pyval, arguments))
        self.calls[function.__module__, function.__qualname__, repr(types)] = types
        if self.random is None:
            return _Answer(1)
        self._fill(arguments)
        return _Answer(self.random.integers(4) > 0)

    def _fill(self, arguments):
        """Write random numbers into the arrays among the arguments, small or large ones."""
        for one in arguments:
            if isinstance(one, tuple):
                self._fill(one)
            elif isinstance(one, np.ndarray) and one.flags.writeable:
                most = 4.0**self.random.integers(1, 3)
                one[...] = (self.random.integers(0, 32, one.shape) if one.dtype.kind in 'iub'
                            else self.random.uniform(0, most, one.shape))


class _Answer(int):
    """A number that unpacks into two, since kernels return one number or two."""

    def __iter__(self):
        return iter((self, self))
