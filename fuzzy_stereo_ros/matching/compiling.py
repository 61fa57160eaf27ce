# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Compile the kernels that a matcher needs, in as many processes as there are cores.

A process of its own makes a dry run of the warm-up, in which kernels are not compiled but note
the types that they are called with. In further rounds they write random numbers into the arrays
that they get, so that the matcher takes all of its branches. Then it forks, and all of its copies
compile. A kernel that the dry run misses is compiled by the warm-up itself.
"""
from contextlib import contextmanager, suppress
from dataclasses import asdict, replace
from functools import cache, partial
import gc
import json
import os
import signal
import subprocess
import sys
import threading
import time
from types import FunctionType
from typing import NamedTuple
import warnings

from fuzzy_stereo_ros.matching.bands import processors
from fuzzy_stereo_ros.matching.config import MatcherConfig
from fuzzy_stereo_ros.matching.kernels import compiled
from fuzzy_stereo_ros.matching.matcher import warm_up_camera, warm_up_pairs
from numba.core.types import BaseFunction
import numpy as np

DRY_RUNS = None, 1, 2, 4   # of a dry run: seeds of what kernels write, None for nothing
# level of LLVM, unless the user sets it: kernels are as fast as at 3, and compiled sooner
OPTIMISATION = {'NUMBA_OPT': '2'}
START = ('import json, sys; sys.path[:], config = json.loads(sys.argv[1]); '
         f'from {__name__} import serve; serve(config)')


class Progress(NamedTuple):
    """Progress of compiling; share: 0 to 1, of the code; left: seconds, None if unknown."""

    share: float
    left: float | None


@contextmanager
def on_all_cores(report=None):
    """Have all cores compile what warm-ups within need; report(Progress): called in any thread."""
    before = compiled.compilers[:]
    compiled.compilers[:] = [cache(partial(compile_kernels, report=report))]
    try:
        yield
    finally:
        compiled.compilers[:] = before
        compiled.before_first.clear()


def compile_kernels(config, report=None):
    """Compile and keep what matchers of a MatcherConfig need; report: as in `on_all_cores`."""
    report = report or (lambda progress: None)
    report(Progress(0.0, None))
    begun, share = None, 0.0
    # In a session of its own Ctrl-C does not reach it: it ends with its standard input.
    with subprocess.Popen(
            [sys.executable, '-c', START, json.dumps([sys.path, asdict(config)])], text=True,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, start_new_session=True,
            env=OPTIMISATION | os.environ) as process:
        for line in process.stdout:
            begun, share = begun or time.monotonic(), share + float(line)
            if share:
                report(Progress(share, (time.monotonic() - begun) * (1 / share - 1)))
    report(Progress(1.0, 0.0))


def serve(config):
    """Compile what a warm-up calls, on all cores; print the share of the code of each, first 0."""
    _end_with_input()
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)       # ends it where nobody reads its answers
    answers = os.dup(1)
    os.dup2(2, 1)       # prints go to stderr, not among the answers
    sizes = {call: _size(call[0], set()) for call in record_calls(MatcherConfig(**config))}
    calls, (tickets, filled) = sorted(sizes, key=sizes.get, reverse=True), os.pipe()
    os.write(answers, b'0\n')
    os.write(filled, b''.join(number.to_bytes(2, 'big') for number in range(len(calls))))
    os.close(filled)
    compile_sooner()
    forked = []
    while len(forked) < processors() - 1 and 0 not in forked:
        forked.append(os.fork())
    if 0 in forked:
        _end_with_input()
    while ticket := os.read(tickets, 2):
        call = calls[int.from_bytes(ticket, 'big')]
        with suppress(Exception):       # the warm-up meets the same error and raises it
            call[0].compile(call[1])
        gc.collect(0)
        os.write(answers, f'{sizes[call] / sum(sizes.values())}\n'.encode())
    if 0 in forked:
        os._exit(0)
    for process in forked:
        os.waitpid(process, 0)


def _end_with_input():
    """End this process with its standard input, in a thread: nothing else interrupts numba."""
    threading.Thread(target=lambda: (os.read(0, 1), os._exit(0)), daemon=True).start()


def compile_sooner():
    """
    Have a process that compiles kernels alone take a third less time; it collects garbage itself.

    Numba types an operator once for some arguments: it may where all has the same options.
    """
    def call_type(function, context, types, named):
        key = function, types, tuple(named.items())
        if key not in known:
            signature = find(function, context, types, named)
            known[key] = signature, function.get_impl_key(signature)
        signature, function._impl_keys[signature.args] = known[key]
        return signature
    known, find, BaseFunction.get_call_type = {}, BaseFunction.get_call_type, call_type
    gc.disable()


def record_calls(config):
    """Return the calls of a warm-up: {(kernel, types of its arguments)}."""
    noted, config = {}, replace(config, threads=1)
    for seed in DRY_RUNS:
        random = None if seed is None else np.random.default_rng(seed)
        for kernel in compiled.kernels:
            kernel.compile = partial(_note, noted, kernel, random)
        with warnings.catch_warnings(), np.errstate(all='ignore'):
            warnings.simplefilter('ignore')
            for matcher, left, right in warm_up_pairs(config):
                with suppress(Exception):       # random numbers may break what follows
                    matcher.match(left, right, camera=warm_up_camera(left))
    for kernel in compiled.kernels:
        del kernel.compile
    return list(noted)


def _note(noted, kernel, random, types):
    """Take the place of `kernel.compile`: note the types, and return what is called instead."""
    noted[kernel, types] = None

    def answer(*arguments):
        if random is None:
            return _Answer(1)
        _fill(arguments, random)
        return _Answer(random.integers(4) > 0)
    return answer


def _fill(arguments, random):
    """Write random numbers into the arrays among the arguments, small or large ones."""
    for one in arguments:
        if isinstance(one, tuple):
            _fill(one, random)
        elif isinstance(one, np.ndarray) and one.flags.writeable:
            one[...] = (random.integers(0, 32, one.shape) if one.dtype.kind in 'iub'
                        else random.uniform(0, 4.0**random.integers(0, 3), one.shape))


class _Answer(int):
    """A number that unpacks into two, since kernels return one number or two."""

    def __iter__(self):
        return iter((self, self))


def _size(function, seen):
    """Return the size of a function's code in bytes, with that of all that it calls."""
    function = getattr(function, 'py_func', function)
    if not isinstance(function, FunctionType) or function in seen:
        return 0
    seen.add(function)
    code, names = function.__code__, function.__globals__
    return len(code.co_code) + sum(_size(names.get(name), seen) for name in code.co_names)
