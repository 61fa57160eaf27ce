# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
How each of our programs starts and ends: arguments, exit codes, errors in one sentence, signals.

And how it returns freed memory to the system, where the C library is glibc.

Exit codes: 0 done; 2 bad input, with one sentence on standard error; 130 interrupted by the user;
141 broken pipe; 143 terminated. Others are the program's own.
"""
import argparse
from contextlib import contextmanager, nullcontext
import ctypes
import os
import re
import signal
import sys
import threading

BAD_INPUT = 2
INTERRUPTED = 130
BROKEN_PIPE = 141   # as of a process that SIGPIPE ends
TERMINATED = 143
M_ARENA_MAX = -8        # of glibc's malloc.h
ROS_MODULE = re.compile(r'(rcl|rmw|ros|launch|ament_)|\w+_(interfaces|msgs|srvs)$')


def run_program(make_parser, argv=None):
    """Run a program of the Parser that make_parser() returns, and return its exit code."""
    for name in ('stdout', 'stderr'):       # closed streams ignore what is written
        if getattr(sys, name) is None:
            setattr(sys, name, os.fdopen(os.open(os.devnull, os.O_WRONLY), 'w'))
        stream = getattr(sys, name)
        if getattr(stream, 'errors', None) == 'strict':     # names of files may have any bytes
            stream.reconfigure(errors='backslashreplace')
    with _sigterm_as_sigint() as terminated:
        try:
            parser = make_parser()
            from fuzzy_stereo_ros.progress import show_compiling
            show_compiling()
            if parser.has_commands() and not (sys.argv[1:] if argv is None else argv):
                parser.print_help(sys.stderr)
                return BAD_INPUT
            code = run_cleanly(parser, argv)
        except KeyboardInterrupt:
            code = INTERRUPTED
        return TERMINATED if code == INTERRUPTED and terminated() else code


@contextmanager
def catching(number, act):
    """
    Yield a function that returns whether a signal came; act(times) is called each time.

    Outside the main thread, where Python allows no signal handlers, it always returns False.
    """
    received = []

    def handle(number, frame):
        received.append(number)
        act(len(received))

    if threading.current_thread() is not threading.main_thread():
        yield lambda: False
        return
    before = signal.signal(number, handle)
    try:
        yield lambda: bool(received)
    finally:
        signal.signal(number, before)


def _sigterm_as_sigint():
    """Catch SIGTERM, which stops services and containers, like Ctrl-C, unless that is ignored."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:       # in the background of a script
        return nullcontext(lambda: False)
    return catching(signal.SIGTERM, lambda times: signal.raise_signal(signal.SIGINT))


class Parser(argparse.ArgumentParser):
    """A parser without abbreviations that reports an error in one line, and what was meant."""

    def __init__(self, **options):
        self._words = []        # that are parsed
        super().__init__(allow_abbrev=False, **options)

    def parse_known_args(self, args=None, namespace=None):
        """Parse arguments; those that are unknown to a command are an error of that command."""
        self._words = sys.argv[1:] if args is None else args
        found, unknown = super().parse_known_args(args, namespace)
        if unknown:
            self.error(f"unrecognized arguments: {' '.join(unknown)}")
        return found, unknown

    def error(self, message):
        """End the process; an option that is nearly one of the parser goes before the message."""
        words = self._words[:1] if self.has_commands() else self._words
        names = [word.split('=')[0] for word in words if word.startswith('--')]
        mistyped = [name + meant for name in names if name not in self._option_string_actions
                    and (meant := _meant(name, self._option_string_actions))]
        if mistyped:
            message = f"unrecognized arguments: {', '.join(mistyped)}"
        self.exit(BAD_INPUT, f'{self.prog}: {message}\n')

    def _check_value(self, action, value):
        try:
            super()._check_value(action, value)
        except argparse.ArgumentError as error:
            error.message += _meant(str(value), action.choices)
            raise

    def has_commands(self):
        """Return whether the first argument is the name of a command."""
        return self._subparsers is not None

    def waive(self, *names):
        """Make the arguments of these names optional."""
        for action in self._actions:
            if action.dest in names:
                action.required = False


def _meant(word, choices):
    from fuzzy_stereo_ros.parameters.table import nearest

    return nearest(word, list(choices), 0.7)


def run_cleanly(parser, argv):
    """
    Parse the arguments, call their `run`, and return the exit code.

    A ValueError or OSError means bad input; its text is printed as one sentence. After an
    interruption `on_interrupt` of the arguments, where they have it, says what is left.
    """
    arguments = None
    try:
        try:
            arguments = parser.parse_args(argv)
            return arguments.run(arguments) or 0
        finally:        # also after --help and unknown options
            try:
                sys.stdout.flush()
            except OSError:
                # Python flushes again at exit, and would print a traceback.
                os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
                raise
    except BrokenPipeError:
        return BROKEN_PIPE
    except (ValueError, OSError) as error:
        print(f'{parser.prog}: {_sentence(error)}', file=sys.stderr)
        return BAD_INPUT
    except KeyboardInterrupt:
        on_interrupt = getattr(arguments, 'on_interrupt', '')
        if on_interrupt:
            begin = '\n' if sys.stderr.isatty() else ''     # a bar may stand there
            print(f'{begin}{parser.prog}: interrupted; {on_interrupt}', file=sys.stderr)
        return INTERRUPTED


def _sentence(error):
    """Return an exception's text in one line, without errno; escaped, as it may quote a file."""
    text = str(error)
    if getattr(error, 'errno', None) is not None:
        text = error.strerror if error.filename is None else f'{error.filename}: {error.strerror}'
    return ''.join(sign if sign.isprintable() else ascii(sign)[1:-1] for sign in text)


def say_that_ros_is_missing():
    """End a program that cannot import ROS with a sentence, not a traceback; exit code 1."""
    usual = sys.excepthook

    def hook(kind, error, trace):
        name = (getattr(error, 'name', None) or '').split('.')[0]
        if not issubclass(kind, ImportError) or not ROS_MODULE.match(name):
            usual(kind, error, trace)
            return
        print(f'this program needs ROS 2, but {sys.executable} cannot import {name}: source the '
              "setup.bash of ROS for a Python of its version, or `pip install '.[ros]'` in this "
              "package's sources; fuzzy-stereo and StereoMatcher need no ROS", file=sys.stderr)
    sys.excepthook = hook


def use_one_arena():
    """
    Make all threads allocate from one arena; to be called before other threads start.

    glibc gives each thread its own arena, and `malloc_trim` does not trim the top of any but the
    first: each thread would keep up to 64 MB of free memory.
    """
    mallopt = getattr(ctypes.CDLL(None), 'mallopt', None)
    if mallopt is not None:
        mallopt(M_ARENA_MAX, 1)


def give_back_memory():
    """
    Return freed memory to the system, which takes some ms.

    glibc keeps freed memory that lies below memory in use: as every change of parameters makes a
    new matcher, the process would grow to twice its size.
    """
    trim = getattr(ctypes.CDLL(None), 'malloc_trim', None)
    if trim is not None:
        trim(0)
