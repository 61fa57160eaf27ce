# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a soak measures and what must hold of it; imports no ROS."""
from collections import Counter
from contextlib import suppress
from pathlib import Path
import re
from typing import NamedTuple

import numpy as np

PAIRS = 'pairs synchronised', 'pairs matched', 'pairs dropped', 'pairs rejected', 'pairs waiting'
PLACE = re.compile(r'-\d+_\d+$')     # in the name of a thread of a pool: which pool and thread
LOST = re.compile(r'(\d+) (pairs dropped|pairs rejected|unmatched [^\s,]+|lost [^\s,]+)')
REJECTED = ']: pair rejected: '


class Sample(NamedTuple):
    """
    The node between two rounds.

    megabytes: asked of the C library and not freed. objects: blocks in Python's memory.
    resident: MB of its process, without what the middleware shares; with what is free, but kept.
    work: ms of processor time for a pair.
    """

    megabytes: float
    objects: int
    resident: float
    work: float


class Promise(NamedTuple):
    """What is promised, what was found, and whether it was kept."""

    name: str
    found: str
    kept: bool


class Run(NamedTuple):
    """
    What was seen of a soak.

    samples: list of Sample after the warm-up. counts: as of `broken_sums`, of the last
    diagnostics, with nothing waiting. log: text of the node. broken: all that `broken_sums`
    returned. code: the node's exit code. threads: Threads.
    """

    samples: list
    counts: dict
    log: str
    broken: list
    code: int
    threads: object


def threads_of(process):
    """Return {id: name} of the threads of a process, by its id."""
    found = {}
    for task in Path(f'/proc/{process}/task').iterdir():
        with suppress(FileNotFoundError, ProcessLookupError):   # it has just ended
            found[int(task.name)] = (task / 'comm').read_text().strip()
    return found


class Threads:
    """
    The threads of a process: which there were when it first was at rest, and which came later.

    most: how many there were at a time. left: what `left_over` returned last.
    """

    def __init__(self, process):
        """Begin with nothing seen; process: its id."""
        self._process, self._first, self._since = process, None, {}
        self.most, self.left = 0, []

    def note(self, event):
        """Look which threads there are after an event."""
        found = threads_of(self._process)
        self.most = max(self.most, len(found))
        for number in found:
            self._since.setdefault(number, event)

    def left_over(self, names):
        """
        Return and keep what is new since the first call: for each thread a name and since when.

        The process is at rest. One that has taken the place of another of its name is not new.
        names: {id: name} of those with a better name than the system knows.
        """
        found = threads_of(self._process)
        found.update({int(number): PLACE.sub('', name) for number, name in names.items()
                      if int(number) in found})
        if self._first is None:
            self._first = found
        more = Counter(found.values()) - Counter(self._first.values())
        self.left = []
        for number, name in found.items():
            if number not in self._first and more[name]:
                more[name] -= 1
                self.left.append(f"{name} (since {self._since.get(number, 'a sample')})")
        return self.left

    def __str__(self):
        left = ', '.join(f'{times} x {name}' for name, times in Counter(self.left).items())
        return f"{len(self._first)}, up to {self.most} after events; left over: {left or 'none'}"


def growth(values):
    """Return by how many % the median of the last third is above that of the first."""
    third = -(-len(values) // 3)
    return 100 * (np.median(values[-third:]) / np.median(values[:third]) - 1)


def losses_told(log):
    """Return a Counter of the losses that the lines of a log tell, by the keys of diagnostics."""
    told = Counter()
    for line in log.splitlines():
        if ' since the last report ' in line:
            told.update({key: int(number) for number, key in LOST.findall(line)})
    return told


def losses_of(counts):
    """Return those of the counts of diagnostics that a log must tell, as `losses_told` does."""
    return {key: number for key, number in counts.items() if number and (
        key in ('pairs dropped', 'pairs rejected') or key.startswith(('unmatched ', 'lost ')))}


def whole_numbers(diagnostics):
    """Return {key: number} of {key: text}, of those that are whole numbers."""
    return {key: int(text) for key, text in diagnostics.items() if text.isdecimal()}


def faults_of(log):
    """Return the lines of a log that tell of a fault, not of what was rejected."""
    return [line for line in log.splitlines() if 'Traceback' in line or '[FATAL]' in line
            or 'internal error' in line
            or ('[ERROR]' in line and REJECTED not in line)]


def broken_sums(counts, sent):
    """
    Return sentences on what does not add up, when nothing is under way.

    counts: {key: number} of diagnostics. sent: {topic: messages that were sent to the node}.
    """
    pairs = {key: counts[key] for key in PAIRS}
    total, *parts = pairs.values()
    broken = [] if total == sum(parts) else [f'{pairs} do not add up']
    rejected = sum(number for key, number in counts.items() if key.startswith('rejected: '))
    if rejected != counts['pairs rejected']:
        broken.append(f"rejected by reason are {rejected}, in all {counts['pairs rejected']}")
    for topic, messages in sent.items():
        received, unmatched, lost = (
            counts[f'{what} {topic}'] for what in ('received', 'unmatched', 'lost'))
        if received + lost != messages:
            broken.append(f'{topic}: {messages} sent, {received} received, {lost} lost')
        if not 0 <= received - unmatched - total <= counts['queue_size']:
            broken.append(f'{topic}: {received} received, but {unmatched} unmatched and {total} '
                          'in pairs')
    return broken


def promises_of(run, limits):
    """
    Return the Promises of a Run.

    limits: {'memory': %, 'resident': %, 'work': %}.
    """
    held, objects, resident, work = zip(*run.samples)
    counts, log, broken, code = run.counts, run.log, run.broken, run.code
    told = losses_told(log)
    lost = losses_of(counts)
    faults = faults_of(log)
    return [
        Promise('sent = matched + dropped + rejected + unmatched + lost',
                'at every turn' if not broken else '; '.join(broken), not broken),
        Promise('every loss is in the log', f'{sum(told.values())} of {sum(lost.values())}',
                dict(told) == lost),
        Promise(f"memory in use grows by less than {limits['memory']:g} %",
                f'{growth(held):+.2f} % of {held[0]:.2f} MB, '
                f'{growth(objects):+.2f} % of {objects[0]} objects',
                max(growth(held), growth(objects)) < limits['memory']),
        Promise(f"resident memory grows by less than {limits['resident']:g} %",
                f'{growth(resident):+.2f} % of {resident[0]:.1f} MB',
                growth(resident) < limits['resident']),
        Promise(f"a pair's processor time grows by less than {limits['work']:g} %",
                f'{growth(work):+.0f} % of {work[0]:.1f} ms',
                growth(work) < limits['work']),
        Promise('no thread is left over', str(run.threads), not run.threads.left),
        Promise('nothing is logged as a fault', faults[0] if faults else 'nothing', not faults),
        Promise('SIGINT ends the node with code 0', str(code), code == 0)]
