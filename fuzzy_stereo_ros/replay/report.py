# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a replay says: how far it is, what it meets, and how it went."""
import sys

from fuzzy_stereo_ros.bags.reading import DamagedBag
from fuzzy_stereo_ros.replay.cluster import ClusterFault
from fuzzy_stereo_ros.replay.segments import SEGMENT_PAIRS
from fuzzy_stereo_ros.reports import kind_of

SECOND = 1_000_000_000


class Shown:
    """A bar and sentences on standard error; a context manager."""

    def __init__(self, total, stream=None, always=False):
        """
        Begin a bar where the stream is a terminal, or always; without tqdm there is none.

        total: pairs that are expected, about. stream: a text, standard error if None.
        """
        self._stream, self._told, self._bar = stream or sys.stderr, set(), None
        if always or self._stream.isatty():
            try:
                from tqdm import tqdm
            except ImportError:
                return
            self._bar = tqdm(total=total, unit=' pairs', file=self._stream, dynamic_ncols=True,
                             desc='loading the kernels')

    def __enter__(self):
        return self

    def __exit__(self, *error):
        if self._bar is not None:
            self._bar.close()

    def step(self):
        """Note that another pair has come."""
        if self._bar is not None:
            self._bar.set_description(refresh=False)
            self._bar.update()

    def tell(self, sentence):
        """Write a sentence; of those that differ only in numbers the first."""
        if kind_of(sentence) in self._told:
            return
        self._told.add(kind_of(sentence))
        if self._bar is None:
            self._stream.write(sentence + '\n')
        else:
            self._bar.write(sentence, file=self._stream)


def figures_of(tally, synchroniser, begin):
    """
    Return what a Tally and a Synchroniser counted, for JSON.

    begin: ns, when the first message of the bag was recorded.
    """
    seconds = max(tally.seconds, 1e-9)
    pairs = tally.matched + tally.again
    figures = {
        'ended': _ended(tally),
        'pairs': {'matched': tally.matched, 'matched_again': tally.again, 'warm': tally.warm,
                  'refused': dict(tally.refused)},
        'messages': {'received': synchroniser.received, 'unmatched': synchroniser.unmatched},
        'remarks': list(tally.remarks.values()),
        'last_pair': None if tally.logged is None else {
            'stamp': tally.stamp, 'seconds_into_the_bag': (tally.logged - begin) / SECOND},
        'seconds': tally.seconds,
        'pairs_per_second': (tally.matched if tally.workers else pairs) / seconds,
        'match_ms': tally.milliseconds / max(pairs, 1),
        'share_not_matching': 1 - tally.milliseconds / 1000 / seconds / max(tally.workers, 1),
    }
    if tally.workers:
        figures['segments'] = {'matched': tally.segments, 'pairs': SEGMENT_PAIRS,
                               'workers': tally.workers}
    return figures


def sentences(figures, approximate):
    """Return the figures as a person reads them; approximate: whether stamps may differ."""
    pairs, messages = figures['pairs'], figures['messages']
    lines = [f"{pairs['matched']} pairs matched"]
    if 'segments' in figures:
        lines[0] += ', in {matched} segments on {workers} workers'.format(**figures['segments'])
        if pairs['matched_again']:
            lines[0] += f", {pairs['matched_again']} were matched again to warm up"
    elif pairs['matched_again']:
        lines[0] += f", after {pairs['matched_again']} that were matched again to warm up"
    if pairs['refused']:
        lines.append(f"{sum(pairs['refused'].values())} refused: " + ', '.join(
            f'{reason} {number}' for reason, number in sorted(pairs['refused'].items())))
    unmatched = {topic: number for topic, number in messages['unmatched'].items() if number}
    if unmatched:
        lines.append('messages without partner: ' + ', '.join(
            f"{topic} {number} of {messages['received'][topic]}"
            for topic, number in unmatched.items()))
    if any(2 * number > messages['received'][topic] for topic, number in unmatched.items()):
        lines.append(f'to match more of them, {_remedy(approximate)}')
    lines.append(
        f"{figures['pairs_per_second']:.1f} pairs/s, {figures['match_ms']:.1f} ms of matching a "
        f"pair; {100 * figures['share_not_matching']:.1f} % of the time was not matching")
    return '\n'.join(lines)


def no_pair_sentence(name, tally, synchroniser, approximate):
    """
    Return why no pair of a bag was matched and what to do.

    name: of the bag. approximate: whether stamps may differ.
    """
    refused = sum(tally.refused.values())
    if refused:
        return f'{name}: none of {refused} pairs could be matched; the first: ' \
               f'{tally.first_refusal}'
    counts = ', '.join(f'{topic} {number}' for topic, number in synchroniser.received.items())
    sentence = f'{name}: no message found its partners; messages: {counts}'
    silent = [topic for topic, number in synchroniser.received.items() if not number]
    if silent:
        return f"{sentence}; there is none of {', '.join(silent)} in what was chosen"
    difference = synchroniser.difference()
    if difference:
        sentence += f'; the latest stamps differ by up to {difference / 1e6:.3f} ms'
    return f'{sentence}; {_remedy(approximate)}'


def _remedy(approximate):
    """Return what lets more messages find their partners."""
    if approximate:
        return ('raise --tolerance or --queue-size, or give --cache-camera-info if camera_info '
                'comes seldom')
    return ('give --approximate if the cameras do not stamp alike, --cache-camera-info if '
            'camera_info comes seldom, or a larger --queue-size')


def _ended(tally):
    if tally.error is not None:
        return ('damaged bag' if isinstance(tally.error, DamagedBag) else
                'workers lost' if isinstance(tally.error, ClusterFault) else 'cannot be written')
    return 'interrupted' if tally.interrupted else 'finished'
