# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""`python -m bench NAME`: run suites one after the other, print their tables, write the page."""
import argparse
from dataclasses import asdict, replace
from functools import partial
import json
from pathlib import Path
import shutil
import sys

from bench import ablation, accuracy, conditions, drift, paper_tables, speed, tuning, warm
from bench.datasets import data_folder
from bench.draws import Drawn, DRAWS, QUICK_DRAWS
from bench.page import check_page, write_section
from bench.request import Request
from fuzzy_stereo_ros.commands.shared_options import for_json
from fuzzy_stereo_ros.evaluation.matchers import matcher_named, OURS
from fuzzy_stereo_ros.evaluation.report import markdown
from fuzzy_stereo_ros.parameters.options import add_matcher_options, matcher_changes
from fuzzy_stereo_ros.program import Parser, run_program
from fuzzy_stereo_ros.progress import follow

SUITES = {'accuracy': accuracy, 'conditions': conditions, 'speed': speed, 'warm': warm,
          'paper': paper_tables, 'ablation': ablation, 'drift': drift, 'tuning': tuning}
ALL = 'all'
REPEATS, QUICK_REPEATS = 60, 2
DECIDED = ('disparities', 'min_disparity', 'reference', 'fill', 'threads', 'warm_start')

ON_INTERRUPT = 'the page has the sections of finished benchmarks, the others are as before'
DESCRIPTION = '\n'.join((
    'Measure the matcher side by side with OpenCV, and print tables as Markdown.\n',
    *(f'  {name:<11}{suite.__doc__.strip().splitlines()[0]}' for name, suite in SUITES.items()),
    f'  {ALL:<11}all of these, one after the other\n',
    'With --output pictures of the figures are written beside the page.\n',
    'Synthetic scenes and the pair of scikit-image need no data. Scenes of Middlebury and KITTI',
    'are read from --data; the report names those that are missing there.\n',
    'The node is measured by python -m bench.live.'))
EXAMPLE = ('examples:\n'
           '  python -m bench accuracy paper --data ../shared/data --output docs/benchmarks.md\n'
           '  python -m bench all --quick --output /tmp/page.md')


def main(argv=None):
    """Run the suites that the arguments name (None: those of the process); return the code."""
    return run_program(_parser, argv)


def _parser():
    """Return the parser of the suites."""
    parser = Parser(prog='bench', description=DESCRIPTION, epilog=EXAMPLE,
                    formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('names', metavar='NAME', nargs='+', choices=(*SUITES, ALL),
                        help=', '.join((*SUITES, ALL)))
    parser.add_argument('--data', metavar='DIR',
                        help='folder of the benchmark data; default: $FUZZY_STEREO_DATA, or '
                             '../shared/data if that exists')
    parser.add_argument('--only', metavar='WORD', default='',
                        help='only scenes whose group/name contains this word, for example '
                             'made or middv2/teddy')
    parser.add_argument('--repeats', metavar='N', type=int,
                        help='frames of each matcher that are timed (speed); '
                             f'default: {REPEATS}, with --quick {QUICK_REPEATS}')
    parser.add_argument('--python', metavar='FILE',
                        help='a Python whose libraries have other versions, to be timed too '
                             '(speed), for example one of `make matrix`')
    parser.add_argument('--quick', action='store_true',
                        help='small synthetic scenes, few runs and draws of noise, to see that '
                             'everything runs: the figures then mean nothing')
    parser.add_argument('--output', metavar='FILE.md',
                        help='also write each benchmark into its section of this page')
    parser.add_argument('--csv', metavar='FOLDER',
                        help='also write every figure that was measured, by scene and draw, into '
                             'CSV files of this folder')
    parser.add_argument('--json', action='store_true', help='print JSON instead of Markdown')
    add_matcher_options(parser, left_out=DECIDED)
    parser.set_defaults(run=run, on_interrupt=ON_INTERRUPT)
    return parser


def run(arguments):
    """Run the named suites; ValueError and OSError for bad input, if possible before the first."""
    repeats = arguments.repeats
    if repeats is None:
        repeats = QUICK_REPEATS if arguments.quick else REPEATS
    if repeats < 1:
        raise ValueError(f'--repeats is {repeats}; allowed are 1 and more')
    if arguments.python is not None and shutil.which(arguments.python) is None:
        raise ValueError(f'--python is {arguments.python!r}, which cannot be run; give the path '
                         'of a Python')
    if arguments.output is not None:
        check_page(arguments.output)
    if arguments.csv is not None:
        Path(arguments.csv).mkdir(parents=True, exist_ok=True)
    request = Request(
        matcher_named(OURS, arguments.profile, matcher_changes(arguments)),
        data_folder(arguments.data), arguments.only, repeats,
        partial(follow, stream=sys.stderr), arguments.quick,
        QUICK_DRAWS if arguments.quick else DRAWS, arguments.python)
    request.scenes()        # bad input is found before the first benchmark
    reports = []
    for name in SUITES if ALL in arguments.names else dict.fromkeys(arguments.names):
        report = SUITES[name].run(request)
        reports.append(for_json(asdict(replace(report, pictures={}, figures={}, tables=[replace(
            table, rows=[[[one, one.worst] if isinstance(one, Drawn) else one for one in row]
                         for row in table.rows]) for table in report.tables]))))
        if not arguments.json:
            print(markdown(report), flush=True)
        if arguments.output is not None:
            write_section(arguments.output, report)
        if arguments.csv is not None:
            report.write_figures(arguments.csv)
    if arguments.json:
        print(json.dumps(reports, indent=2))


if __name__ == '__main__':
    sys.exit(main())
