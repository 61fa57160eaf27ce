# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The command `fuzzy-stereo`.

Exit codes: 0 done; 1 a saved pair does not come out as it was; 2 bad input, said in one sentence
on standard error, nothing written, but for a bag that is damaged, or a disk that is full, in the
middle of a replay; 130 interrupted by the user; 141 nobody read what was printed to its end; 143
terminated.
"""
import argparse
from contextlib import contextmanager
from functools import partial
import os
import signal
import sys
import threading

BAD_INPUT = 2
INTERRUPTED = 130
NO_READER = 141     # as of a process that a closed pipe ends
TERMINATED = 143
WITHOUT_KERNELS = 'synthesise', 'convert'


def main(argv=None):
    """Run `fuzzy-stereo` with the arguments (None: those of the process); return its exit code."""
    for name in ('stdout', 'stderr'):       # one that was closed swallows what is written
        if getattr(sys, name) is None:
            setattr(sys, name, os.fdopen(os.open(os.devnull, os.O_WRONLY), 'w'))
    with terminated_as_by_hand() as terminated:
        try:
            code = run_cleanly(_parser(), argv)
        except KeyboardInterrupt:
            code = INTERRUPTED
        return TERMINATED if code == INTERRUPTED and terminated() else code


def commands():
    """Return {name: module} of the commands, which take a second or two to be imported."""
    from fuzzy_stereo_ros.commands import (
        benchmark, convert, evaluate, evolve, match, replay, synthesise, warm_up)

    return {'match': match, 'evolve': evolve, 'replay': replay, 'evaluate': evaluate,
            'benchmark': benchmark, 'synthesise': synthesise, 'convert': convert,
            'warm-up': warm_up}


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


def _parser():
    """Return the parser of all commands."""
    parser = Parser(prog='fuzzy-stereo',
                    description='Dense stereo by a genetic algorithm with a fuzzy fitness.')
    added_to = parser.add_subparsers(title='commands', metavar='COMMAND', required=True)
    for name, command in commands().items():
        added = added_to.add_parser(
            name, help=command.HELP, description=command.DESCRIPTION, epilog=command.EXAMPLE,
            formatter_class=argparse.RawDescriptionHelpFormatter)
        command.add_arguments(added)
        work = partial(command.run, stream=sys.stdout)
        added.set_defaults(run=work if name in WITHOUT_KERNELS else partial(_with_remarks, work))
    return parser


def _with_remarks(work, arguments):
    """Call work(arguments), and tell before and after it what is done without."""
    from fuzzy_stereo_ros.matching.kernels.compiled import remarks

    def tell():
        for remark in remarks():
            print(f'fuzzy-stereo: {remark}', file=sys.stderr)

    tell()
    try:
        return work(arguments)
    finally:
        tell()


class Parser(argparse.ArgumentParser):
    """A parser that takes no abbreviations and reports an error in one line."""

    def __init__(self, **options):
        super().__init__(allow_abbrev=False, **options)

    def error(self, message):
        self.exit(BAD_INPUT, f'{self.prog}: {message}\n')

    def waive(self, *names):
        """Let arguments be left out that are required otherwise."""
        for action in self._actions:
            if action.dest in names:
                action.required = False


def run_cleanly(parser, argv):
    """
    Parse the arguments, call what they set as `run`, and return the exit code.

    A ValueError or OSError is bad input: its text is the one sentence the user reads.
    """
    try:
        try:
            arguments = parser.parse_args(argv)
            return arguments.run(arguments) or 0
        finally:        # after --help, and words that are no options, too
            try:
                sys.stdout.flush()
            except OSError:
                # Python tries once more at its end, and would tell of that at length.
                os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
                raise
    except BrokenPipeError:
        return NO_READER
    except (ValueError, OSError) as error:
        print(f'{parser.prog}: {_sentence(error)}', file=sys.stderr)
        return BAD_INPUT
    except KeyboardInterrupt:
        return INTERRUPTED


def _sentence(error):
    """
    Return what an exception says in a line, without the number an OSError of the system has.

    What a terminal would obey is escaped: it may stand in a file that is rejected.
    """
    said = str(error)
    if getattr(error, 'errno', None) is not None:
        said = error.strerror if error.filename is None else f'{error.filename}: {error.strerror}'
    return ''.join(sign if sign.isprintable() else ascii(sign)[1:-1] for sign in said)


if __name__ == '__main__':
    sys.exit(main())
