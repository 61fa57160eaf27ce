# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a soak measures and what must hold of it; imports no ROS."""
from collections import Counter
import os
from pathlib import Path
import re
from typing import NamedTuple

import numpy as np

PAIRS = 'pairs synchronised', 'pairs matched', 'pairs dropped', 'pairs refused', 'pairs waiting'
LOST = re.compile(r'(pairs dropped|unmatched \S+|lost \S+) (\d+)')
REFUSED = re.compile(r'\]: pair dropped: .*?(?:\((\d+) times in the last \d+ s\))?$')


class Sample(NamedTuple):
    """
    The node between two rounds.

    megabytes, threads: of its process, without what the middleware shares. latency: ms of a pair,
    the median. share: the median of latency by the time of the same match in another process,
    which a busy machine slows alike.
    """

    megabytes: float
    threads: int
    latency: float
    share: float


class Promise(NamedTuple):
    """What is promised, what was found, and whether it was kept."""

    name: str
    found: str
    kept: bool


def megabytes_of(process):
    """Return the MB of memory in use that a process shares with no other, by its id."""
    resident, shared = map(int, Path(f'/proc/{process}/statm').read_text().split()[1:3])
    return (resident - shared) * os.sysconf('SC_PAGE_SIZE') / 1e6


def threads_of(process):
    """Return how many threads a process has, by its id."""
    return len(list(Path(f'/proc/{process}/task').iterdir()))


def growth(values):
    """Return by how many % the median of the last third is above that of the first."""
    third = -(-len(values) // 3)
    return 100 * (np.median(values[-third:]) / np.median(values[:third]) - 1)


def losses_told(log):
    """Return a Counter of the losses that the lines of a log tell, by the keys of diagnostics."""
    told = Counter()
    for line in log.splitlines():
        if 'since such a line: ' in line:
            told.update({key: int(number) for key, number in LOST.findall(line)})
        elif found := REFUSED.search(line):
            told['pairs refused'] += int(found[1] or 1)
    return told


def broken_sums(counts, sent):
    """
    Return sentences on what does not add up, when nothing is under way.

    counts: {key: number} of diagnostics. sent: {topic: messages that were sent to the node}.
    """
    pairs = {key: counts[key] for key in PAIRS}
    total, *parts = pairs.values()
    broken = [] if total == sum(parts) else [f'{pairs} do not add up']
    refused = sum(number for key, number in counts.items() if key.startswith('refused: '))
    if refused != counts['pairs refused']:
        broken.append(f"refused by reason are {refused}, in all {counts['pairs refused']}")
    for topic, messages in sent.items():
        received, unmatched, lost = (
            counts[f'{what} {topic}'] for what in ('received', 'unmatched', 'lost'))
        if received + lost != messages:
            broken.append(f'{topic}: {messages} sent, {received} received, {lost} lost')
        if not 0 <= received - unmatched - total <= counts['queue_size']:
            broken.append(f'{topic}: {received} received, but {unmatched} unmatched and {total} '
                          'in pairs')
    return broken


def promises_of(samples, limits, counts, log, broken, code):
    """
    Return the Promises of a soak.

    samples: list of Sample after the warm-up. limits: {'memory': %, 'latency': %}. counts: as of
    `broken_sums`, of the last diagnostics, with nothing waiting. log: text of the node. broken:
    all that `broken_sums` returned. code: the node's exit code.
    """
    memory, threads, latency, share = zip(*samples)
    told = losses_told(log)
    lost = {key: number for key, number in counts.items() if number and (
        key in ('pairs dropped', 'pairs refused') or key.startswith(('unmatched ', 'lost ')))}
    faults = [line for line in log.splitlines() if 'Traceback' in line or '[FATAL]' in line
              or 'by a fault of this package' in line
              or ('[ERROR]' in line and not REFUSED.search(line))]
    return [
        Promise('sent = matched + dropped + refused + unmatched + lost',
                'at every turn' if not broken else '; '.join(broken), not broken),
        Promise('every loss is in the log', f'{sum(told.values())} of {sum(lost.values())}',
                dict(told) == lost),
        Promise(f"memory grows by less than {limits['memory']:g} %",
                f'{growth(memory):+.2f} % of samples between {min(memory):.1f} and '
                f'{max(memory):.1f} MB',
                growth(memory) < limits['memory']),
        Promise(f"latency grows by less than {limits['latency']:g} %, the machine aside",
                f'{growth(share):+.0f} %: {latency[0]:.1f} to {latency[-1]:.1f} ms',
                growth(share) < limits['latency']),
        Promise('no thread is left over', f'{threads[0]}, later {min(threads)} to {max(threads)}',
                max(threads) == threads[0]),
        Promise('nothing is logged as a fault', faults[0] if faults else 'nothing', not faults),
        Promise('SIGINT ends the node with code 0', str(code), code == 0)]
