# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The progress bar of a replay, and its report in figures and sentences."""
from contextlib import AbstractContextManager
import sys

from fuzzy_stereo_ros.bags.reading import DamagedBag, text_of
from fuzzy_stereo_ros.matching.row_offsets import row_offset_in_words
from fuzzy_stereo_ros.pairs.result_messages import DISPARITY
from fuzzy_stereo_ros.pairs.stereo_pair import kind_of, number_of
from fuzzy_stereo_ros.progress import bar
from fuzzy_stereo_ros.replay.options import SEGMENT_PAIRS
from fuzzy_stereo_ros.replay.segments import ClusterError
from fuzzy_stereo_ros.replay.source import SECOND


class ProgressBar(AbstractContextManager):
    """A progress bar and log lines on one stream; a context manager."""

    def __init__(self, total, stream=None):
        """Start the bar if the stream, None = standard error, is a terminal."""
        self._stream, self._logged = stream or sys.stderr, set()
        self._bar = bar(self._stream, total=total, unit=' pairs',
                        desc='loading the kernels')

    def __exit__(self, *error):
        self._bar.close()

    def step(self):
        self._bar.set_description(refresh=False)
        self._bar.update()

    def log(self, sentence):
        """Write a sentence, unless one that differs only in its numbers was written."""
        if kind_of(sentence) not in self._logged:
            self._logged.add(kind_of(sentence))
            self._bar.write(sentence, file=self._stream)


def figures_of(stats, synchroniser, begin):
    """Return the counts of Stats and Synchroniser for JSON; begin: ns, of the first message."""
    seconds = max(stats.seconds, 1e-9)
    pairs, misalignment = stats.matched + stats.rematched, stats.misalignment
    ended = 'interrupted' if stats.interrupted else 'finished'
    if stats.error is not None:
        ended = ('damaged bag' if isinstance(stats.error, DamagedBag) else
                 'workers lost' if isinstance(stats.error, ClusterError) else 'cannot be written')
    figures = {
        'ended': ended,
        'pairs': {'matched': stats.matched, 'matched_again': stats.rematched, 'warm': stats.warm,
                  'rejected': dict(stats.rejected)},
        'messages': {'received': synchroniser.received, 'unmatched': synchroniser.unmatched},
        'remarks': list(stats.remarks.values()),
        'hints': list(stats.findings.values()),
        'last_pair': None if stats.log_time is None else {
            'stamp': stats.stamp, 'seconds_into_the_bag': (stats.log_time - begin) / SECOND},
        'seconds': stats.seconds,
        'pairs_per_second': (stats.matched if stats.workers else pairs) / seconds,
        'match_ms': stats.milliseconds / max(pairs, 1),
        'share_not_matching': 1 - stats.milliseconds / 1000 / seconds / max(stats.workers, 1),
        'misalignment': misalignment and misalignment.record,
        'row_offset': row_offset_in_words(misalignment),
    }
    if stats.workers:
        figures['segments'] = {'matched': stats.segments, 'pairs': SEGMENT_PAIRS,
                               'workers': stats.workers}
    return figures


def sentences(figures, approximate):
    """Return the figures as sentences; approximate: whether stamps may differ."""
    pairs, messages = figures['pairs'], figures['messages']
    lines = [f"{number_of(pairs['matched'], 'pair')} matched"]
    if 'segments' in figures:
        lines[0] += ', in {} on {}'.format(number_of(figures['segments']['matched'], 'segment'),
                                           number_of(figures['segments']['workers'], 'worker'))
    if pairs['matched_again']:
        lines[0] += f", {pairs['matched_again']} matched again to warm up"
    if pairs['rejected']:
        lines.append(f"{sum(pairs['rejected'].values())} rejected: " + ', '.join(
            f'{reason} {number}' for reason, number in sorted(pairs['rejected'].items())))
    unmatched = {topic: number for topic, number in messages['unmatched'].items() if number}
    if unmatched:
        lines.append('messages not synchronised: ' + ', '.join(
            f"{topic} {number} of {messages['received'][topic]}"
            for topic, number in unmatched.items()))
    if any(2 * number > messages['received'][topic] for topic, number in unmatched.items()):
        lines.append(f'to synchronise more of them, {_remedy(approximate)}')
    lines.append(
        f"{figures['pairs_per_second']:.1f} pairs/s, {figures['match_ms']:.1f} ms of matching a "
        f"pair; {100 * figures['share_not_matching']:.0f} % of the time went into reading "
        'and writing')
    if figures['reach']:
        lines.append(f"searched: {figures['reach']}")
    lines += filter(None, [figures['points_reach']])
    lines += [*figures['losses'], *(f'hint: {sentence}' for sentence in figures['hints'])]
    lines.append(f"row offset: {figures['row_offset']}")
    return '\n'.join(lines)


def no_pair_sentence(name, options, outputs, source, stats):
    """Return why no new pair of a bag was matched, and what to do; name: of the bag."""
    if stats.error is not None:
        return (f"{stats.error}; no {'new ' if outputs.continued else ''}pair could be matched "
                'before that')
    if outputs.continued:
        return f'--resume: the last pairs in {outputs.path} are not in {name}'
    synchroniser, rejected = source.synchroniser, sum(stats.rejected.values())
    if rejected:
        return (f"{name}: none of {number_of(rejected, 'pair')} could be matched; the first: "
                f'{stats.first_rejection}')
    counts = ', '.join(f'{topic} {number}' for topic, number in synchroniser.received.items())
    sentence = f'{name}: no messages were synchronised; received: {counts}'
    silent = [topic for topic, number in synchroniser.received.items() if not number]
    if silent:
        return f"{sentence}; the selected time has no messages of {', '.join(silent)}"
    difference = synchroniser.difference()
    if difference:
        sentence += f'; the latest stamps differ by up to {difference / 1e6:.3f} ms'
    return f"{sentence}; {_remedy(options.settings['approximate_sync'])}"


def _remedy(approximate):
    if approximate:
        return ('raise --tolerance or --queue-size, or give --cache-camera-info if camera_info '
                'is published rarely')
    return ('give --approximate if the cameras do not stamp alike, --cache-camera-info if '
            'camera_info is published rarely, or a larger --queue-size')


def end_sentence(stats, outputs, options, begin):
    """Return a sentence: why a replay ended early, and how far it got; outputs: closed."""
    where = options.output if options.can_be_resumed else options.video
    pairs, log_time = outputs.written, outputs.log_time
    far = f"{number_of(pairs, 'pair')} {'was' if pairs == 1 else 'were'} written to {where}"
    if outputs.bag_sink is not None:
        bag = outputs.bag_sink.bag
        pairs, log_time = bag.counts[f'/{DISPARITY}'], bag.last
        far = f"{where} holds {number_of(pairs, 'pair')}"
    if pairs:
        far += f', up to {(log_time - begin) / SECOND:.3f} s into the bag'
    if stats.error is None:
        if not pairs:
            return 'interrupted before the first pair'
        return f"interrupted: {far}{'; --resume continues' if options.can_be_resumed else ''}"
    if outputs.sinks is None:
        return f'{options.output} cannot be written: {text_of(stats.error)}'
    if options.can_be_resumed or isinstance(stats.error, DamagedBag):
        return f'{text_of(stats.error)}; {far}'
    return text_of(stats.error)     # a video that failed does not exist
