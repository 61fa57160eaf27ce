# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The command `fuzzy-stereo`.

Exit codes: those of `program.py`, and 1 if the match of a saved pair differs from the saved one.
After bad input nothing is written; a replay keeps what it wrote before a damaged bag or a full
disk.
"""
import argparse
from functools import partial
from importlib.util import find_spec
import os
import sys

import fuzzy_stereo_ros
from fuzzy_stereo_ros.program import Parser, run_program

WITHOUT_KERNELS = 'synthesise', 'convert'


def main(argv=None):
    """Run `fuzzy-stereo` and return its exit code; argv: None = arguments of the process."""
    return run_program(_parser, argv)


def commands():
    """Return {name: module} of the commands; importing them takes a second or two."""
    from fuzzy_stereo_ros.commands import (
        benchmark, convert, evaluate, evolve, match, replay, suggest, synthesise, warm_up)

    return {'match': match, 'evolve': evolve, 'replay': replay, 'evaluate': evaluate,
            'suggest': suggest, 'benchmark': benchmark, 'synthesise': synthesise,
            'convert': convert, 'warm-up': warm_up}


def _parser():
    """Return the parser of all commands; with argcomplete it answers the shell's Tab instead."""
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
                           on_interrupt=command.ON_INTERRUPT)
    if os.environ.get('_ARGCOMPLETE') and find_spec('argcomplete') is not None:
        import argcomplete

        argcomplete.autocomplete(parser)
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


if __name__ == '__main__':
    sys.exit(main())
