# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The node for a long run, with faults from a seed: what it promises, and whether it holds.

`make soak SOAK_ARGS='--minutes 60 --seed 1'`
"""
import argparse
from contextlib import closing
import os
import sys
from tempfile import TemporaryDirectory
import time

from bench.soak.events import DECK, events_of, TOPICS
from bench.soak.promises import broken_sums, promises_of, Run
from bench.soak.stage import Stage
from node_process import own_domain, ros_environment

SHOWN = 'pairs ', 'rejected: ', 'unmatched ', 'lost ', 'stamps went'
FIRST = TOPICS[0]
LIMITS = 'memory', 'resident', 'work'     # options of the same names
SMALL = 3       # samples, below which thirds of a run mean nothing


def soak(arguments, folder):
    """Let events happen for a time; return a Run and how many they were."""
    say = print if arguments.verbose else lambda *words: None
    samples, broken, happened, number = [], [], 0, 0
    with own_domain() as domain, closing(Stage(
            domain, folder, arguments.rows, arguments.columns, arguments.disparities,
            arguments.rate)) as stage:
        stage.begin()
        end = None
        while end is None or time.monotonic() < end or len(samples) < SMALL:
            for event in events_of(arguments.seed, number):
                say(f'round {number}: {event.kind} {event.values}')
                stage.happen(event, arguments.between)
                happened += 1
            found = broken_sums(stage.settle(), stage.sent)
            broken += [f'round {number}: {sentence}' for sentence in found]
            number += 1
            if number >= DECK:      # before that all was new: warming up
                samples.append(stage.sample())
                say(samples[-1])
                end = end or time.monotonic() + 60 * arguments.minutes
        counts = stage.leave_all()
        broken += broken_sums(counts, stage.sent)
        code = stage.node.finish()
        log = stage.node.log()
    return Run(samples, counts, log, broken, code, stage.threads), happened


def table(run, happened, promises):
    """Return the lines of what a soak found."""
    counts = run.counts
    figures = {'events': happened, 'rounds measured': len(run.samples),
               'frames sent': counts[f'received {FIRST}'] + counts[f'lost {FIRST}']}
    figures.update({key: number for key, number in counts.items() if key.startswith(SHOWN)})
    width = max(map(len, [*figures, *(promise.name for promise in promises)]))
    return [*(f'{name:{width}}  {number}' for name, number in figures.items()), '',
            *(f"{one.name:{width}}  {'kept' if one.kept else 'BROKEN'}: {one.found}"
              for one in promises)]


OPTIONS = {     # name: type, default, unit, what it is
    'minutes': (float, 60.0, None, 'after the warm-up, in which everything happens once'),
    'seed': (int, 1, None, 'of what happens'),
    'columns': (int, 640, None, 'of the images'),
    'rows': (int, 480, None, 'of the images'),
    'disparities': (int, 64, None, 'that are searched'),
    'rate': (int, 30, None, 'pairs/s'),
    'between': (float, 3.0, 'SECONDS', 'for how long pairs come between what happens'),
    'memory': (float, 1.0, 'PERCENT', 'by less than which memory in use may grow'),
    'resident': (float, 5.0, 'PERCENT', 'by less than which resident memory may grow'),
    'work': (float, 50.0, 'PERCENT', "by less than which a pair's processor time may grow")}


def parser():
    """Return the parser of the arguments."""
    made = argparse.ArgumentParser(prog='make soak', description=__doc__.strip().splitlines()[0])
    for name, (kind, default, unit, sentence) in OPTIONS.items():
        made.add_argument(f'--{name}', type=kind, default=default, metavar=unit,
                          help=f'{sentence}; default: {default:g}')
    made.add_argument('--log', metavar='FILE', help='write what the node logged')
    made.add_argument('--verbose', action='store_true', help='say what happens')
    return made


def main(words=None):
    """Run a soak, print its table, and return 0, or 1 where a promise is broken."""
    arguments = parser().parse_args(words)
    with TemporaryDirectory(prefix='fuzzy_stereo_ros_soak_') as folder:
        os.environ.update(ros_environment(folder))
        run, happened = soak(arguments, folder)
    if arguments.log is not None:
        with open(arguments.log, 'w', encoding='utf-8') as file:
            file.write(run.log)
    promises = promises_of(run, {name: getattr(arguments, name) for name in LIMITS})
    print('\n'.join(table(run, happened, promises)))
    return int(not all(promise.kept for promise in promises))


if __name__ == '__main__':
    sys.exit(main())
