# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The command `fuzzy-stereo`.

Exit codes: 0 done; 1 the match of a saved pair differs from the saved one; 2 bad input, with one
sentence on standard error and nothing written (a replay keeps what it wrote before a damaged bag
or a full disk); 130 interrupted by the user; 141 broken pipe; 143 terminated.
"""
import argparse
from contextlib import contextmanager
from functools import partial
import os
import signal
import sys
import threading

import fuzzy_stereo_ros

BAD_INPUT = 2
INTERRUPTED = 130
BROKEN_PIPE = 141   # as of a process that SIGPIPE ends
TERMINATED = 143
WITHOUT_KERNELS = 'synthesise', 'convert'


def main(argv=None):
    """Run `fuzzy-stereo` and return its exit code; argv: None = arguments of the process."""
    for name in ('stdout', 'stderr'):       # closed streams ignore what is written
        if getattr(sys, name) is None:
            setattr(sys, name, os.fdopen(os.open(os.devnull, os.O_WRONLY), 'w'))
    with sigterm_as_sigint() as terminated:
        try:
            parser = _parser()
            if not (sys.argv[1:] if argv is None else argv):
                parser.print_help(sys.stderr)
                return BAD_INPUT
            code = run_cleanly(parser, argv)
        except KeyboardInterrupt:
            code = INTERRUPTED
        return TERMINATED if code == INTERRUPTED and terminated() else code


def commands():
    """Return {name: module} of the commands; importing them takes a second or two."""
    from fuzzy_stereo_ros.commands import (
        benchmark, convert, evaluate, evolve, match, replay, synthesise, warm_up)

    return {'match': match, 'evolve': evolve, 'replay': replay, 'evaluate': evaluate,
            'benchmark': benchmark, 'synthesise': synthesise, 'convert': convert,
            'warm-up': warm_up}


@contextmanager
def sigterm_as_sigint():
    """
    Handle SIGTERM, which stops services and containers, like Ctrl-C.

    Yields a function that returns whether SIGTERM was received. If SIGINT is ignored, as in the
    background of a script, SIGTERM still ends the process at once.
    """
    received = []

    def interrupt(number, frame):
        received.append(number)
        signal.raise_signal(signal.SIGINT)

    if (threading.current_thread() is not threading.main_thread()
            or signal.getsignal(signal.SIGINT) is signal.SIG_IGN):
        yield lambda: False
        return
    before = signal.signal(signal.SIGTERM, interrupt)
    try:
        yield lambda: bool(received)
    finally:
        signal.signal(signal.SIGTERM, before)


def _parser():
    """Return the parser of all commands."""
    parser = Parser(prog='fuzzy-stereo',
                    description='Dense stereo by a genetic algorithm with a fuzzy fitness.')
    parser.add_argument('--version', action='version',
                        version=f'%(prog)s {fuzzy_stereo_ros.__version__}')
    added_to = parser.add_subparsers(title='commands', metavar='COMMAND', required=True)
    for name, command in commands().items():
        added = added_to.add_parser(
            name, help=command.HELP, description=command.DESCRIPTION, epilog=command.EXAMPLE,
            formatter_class=argparse.RawDescriptionHelpFormatter)
        command.add_arguments(added)
        work = partial(command.run, stream=sys.stdout)
        added.set_defaults(run=work if name in WITHOUT_KERNELS else partial(_with_remarks, work),
                           left_behind=command.LEFT_BEHIND)
    return parser


def _with_remarks(work, arguments):
    """Return work(arguments); print remarks on the cache of kernels before and after."""
    from fuzzy_stereo_ros.matching.kernels.compiled import remarks

    def print_remarks():
        for remark in remarks():
            print(f'fuzzy-stereo: {remark}', file=sys.stderr)

    print_remarks()
    try:
        return work(arguments)
    finally:
        print_remarks()


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
        words = self._words[:1] if self._subparsers else self._words
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

    def waive(self, *names):
        """Make required arguments optional."""
        for action in self._actions:
            if action.dest in names:
                action.required = False


def _meant(word, choices):
    """Return ' (did you mean X?)' of the choice that is most like a word, '' if none is."""
    from fuzzy_stereo_ros.parameters.table import nearest

    return nearest(word, list(choices))


def run_cleanly(parser, argv):
    """
    Parse the arguments, call their `run`, and return the exit code.

    A ValueError or OSError means bad input; its text is printed as one sentence. After an
    interruption `left_behind` of the arguments, where they have it, says what is left.
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
        left_behind = getattr(arguments, 'left_behind', '')
        if left_behind:
            print(f'{parser.prog}: interrupted; {left_behind}', file=sys.stderr)
        return INTERRUPTED


def _sentence(error):
    """
    Return the text of an exception in one line, without the errno of an OSError.

    Control characters, which may come from a rejected file, are escaped.
    """
    text = str(error)
    if getattr(error, 'errno', None) is not None:
        text = error.strerror if error.filename is None else f'{error.filename}: {error.strerror}'
    return ''.join(sign if sign.isprintable() else ascii(sign)[1:-1] for sign in text)


if __name__ == '__main__':
    sys.exit(main())
