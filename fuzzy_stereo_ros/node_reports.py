# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the node says about itself: throttled sentences, figures, why no pair comes."""
from collections import Counter, deque
from dataclasses import dataclass, fields
import re
import threading
import traceback

from fuzzy_stereo_ros.parameter_table import ros_name
import numpy as np

RECENT = 200    # pairs that medians and percentiles look back on
MOST_KINDS = 100
NUMBERS = re.compile(r'\d[\d.]*')


def kind_of(sentence):
    """Return a sentence without its numbers: what those that differ only there have in common."""
    return NUMBERS.sub('#', sentence)


class Throttle:
    """Lets a sentence through at once, then one of its kind per period with how many came."""

    def __init__(self, period=5.0):
        """Make an empty throttle; period: s."""
        self._period = period
        self._lock = threading.Lock()
        self._kinds = {}        # kind: (when the last line went out, how many since, newest)

    def note(self, sentence, now):
        """
        Take a sentence at a time in s and return the line to log, None for not now.

        Sentences that differ only in numbers are of one kind.
        """
        kind = kind_of(sentence)
        with self._lock:
            if kind not in self._kinds and len(self._kinds) >= MOST_KINDS:
                kind = ''
            last, count, _ = self._kinds.get(kind, (None, 0, ''))
            if last is None or (now - last >= self._period and not count):
                self._kinds[kind] = (now, 0, '')
                return sentence
            self._kinds[kind] = (last, count + 1, sentence)
        return None

    def due(self, now):
        """Return the lines for what was held back for a period; call it regularly."""
        lines = []
        with self._lock:
            for kind, (last, count, sentence) in self._kinds.items():
                if count and now - last >= self._period:
                    lines.append(f'{sentence} ({count} times in the last {now - last:.0f} s)')
                    self._kinds[kind] = (now, 0, '')
        return lines


class Figures:
    """Figures of the pairs that were matched or refused; written by the worker, read anywhere."""

    def __init__(self):
        """Start with nothing counted."""
        self._lock = threading.Lock()
        self._latencies, self._times = deque(maxlen=RECENT), deque(maxlen=RECENT)
        self._match = None
        self.refused = Counter()    # by reason

    def matched(self, match, milliseconds):
        """Note a Match and the ms from its last message to its publishing."""
        with self._lock:
            self._latencies.append(milliseconds)
            self._times.append(dict(match.times))
            self._match = match

    def refuse(self, reason):
        """Count a pair that was not matched, by a word for the reason."""
        with self._lock:
            self.refused[reason] += 1

    def values(self):
        """Return {key: text}: times by stage, latency, and what the newest match was like."""
        with self._lock:
            latencies, times, match = list(self._latencies), list(self._times), self._match
            values = {f'refused: {reason}': str(count)
                      for reason, count in sorted(self.refused.items())}
        if match is None:
            return values
        values |= _median_and_percentile('latency', latencies)
        for stage in times[-1]:
            values |= _median_and_percentile(
                f'time of {stage}', [one[stage] for one in times if stage in one])
        values['generations'] = str(match.generations)
        values['warm'] = str(bool(match.warm)).lower()
        values['mean confidence'] = f'{float(np.mean(match.confidence)):.3f}'
        values['valid share'] = f'{1 - float(np.mean(np.isnan(match.disparity))):.3f}'
        return values


class Rates:
    """How many of each count came per second since the call before."""

    def __init__(self, now):
        """Start at a time in s."""
        self._before, self._counts = now, {}

    def since(self, now, counts):
        """Take counts {name: number} at a time in s and return {name: per second}."""
        seconds = max(now - self._before, 1e-9)
        rates = {name: (count - self._counts.get(name, 0)) / seconds
                 for name, count in counts.items()}
        self._before, self._counts = now, dict(counts)
        return rates


def counts_of(synchroniser, pairs):
    """
    Return {key: number} of a Synchroniser and of what its pairs came to, as in `Lane.counts`.

    pairs synchronised = matched + dropped + refused + waiting.
    """
    counts = {'pairs synchronised': synchroniser.matched, 'pairs matched': pairs['done'],
              'pairs dropped': pairs['dropped'], 'pairs refused': pairs['failed'],
              'pairs waiting': pairs['pending'], 'stamps went back': synchroniser.jumps_back}
    for topic in synchroniser.topics:
        counts[f'received {topic}'] = synchroniser.received[topic]
        counts[f'unmatched {topic}'] = synchroniser.unmatched[topic]
    return counts


def verdict(ready, subscribed, quiet, rates):
    """
    Return (level, sentence) of diagnostics; level: 'OK', 'WARN', 'ERROR' or 'STALE'.

    ready: whether kernels are warm; subscribed: whether an output has a subscriber; quiet: s
    without a pair where that is too long, else 0; rates: per second, as of `counts_of`.
    """
    if not ready:
        return 'STALE', 'loading the kernels'
    if not subscribed:
        return 'OK', 'idle: no output has a subscriber'
    if quiet:
        return 'ERROR', f'no stereo pair for {quiet:.0f} s'
    if rates['pairs refused']:
        return 'WARN', f"refusing {rates['pairs refused']:.1f} pairs/s"
    return 'OK', f"matching {rates['pairs matched']:.1f} pairs/s"


def change_of(in_use, wanted):
    """Return in words how a wanted MatcherConfig differs from the one in use."""
    pairs = [(ros_name(field.name), getattr(wanted, field.name), getattr(in_use, field.name))
             for field in fields(in_use)]
    return ', '.join(f'{name} = {new} (in use: {old})'
                     for name, new, old in pairs if new != old) or 'what is in use'


def change_values(in_use, wanted, state):
    """Return {key: text} of the MatcherConfigs in use and wanted, state as of a Preparation."""
    return {'disparity_range in use': str(in_use.disparities),
            'change of parameters': f'{state}: {change_of(in_use, wanted)}' if state else 'none'}


def trace(error):
    """Return an exception with its traceback, as Python prints it."""
    return ''.join(traceback.format_exception(error)).rstrip()


@dataclass(frozen=True)
class TopicState:
    """What is known of an input topic: messages received, publishers now, incompatible QoS."""

    name: str
    received: int
    publishers: int
    incompatible: str = ''


def no_pair_report(seconds, topics, difference, approximate, large_messages_pass):
    """
    Return one sentence that says why no pair may come and what to do.

    seconds: without a pair. topics: TopicState of each input, the counts since the last pair.
    difference: ns between the latest stamps of two topics at most, or None.
    approximate: whether stamps may differ. large_messages_pass: whether a Fast DDS profile is set.
    """
    counts = ', '.join(f'{topic.name} {topic.received}' for topic in topics)
    report = f'no stereo pair for {seconds:.0f} s; messages since then: {counts}'
    if difference is not None:
        report += f'; the latest stamps differ by up to {difference / 1e6:.3f} ms'
    silent = [topic for topic in topics if not topic.received]
    remedies = [f'{topic.name} is offered with an incompatible QoS ({topic.incompatible}): set '
                f'qos_overrides.{topic.name}.subscription.{topic.incompatible}'
                for topic in topics if topic.incompatible]
    unpublished = [topic.name for topic in silent if not topic.publishers]
    if unpublished:
        remedies.append(f"nobody publishes {', '.join(unpublished)}: start the camera driver, or "
                        'remap the topic')
    lost = [topic.name for topic in silent if topic.publishers and not topic.incompatible]
    if lost:
        hint = ('' if large_messages_pass else
                ', and Fast DDS loses large best-effort images unless both sides run with '
                "FASTRTPS_DEFAULT_PROFILES_FILE set to this package's config/fastdds.xml")
        remedies.append(f"nothing arrives from the publishers of {', '.join(lost)}: they may be "
                        f'silent{hint}')
    if not silent:
        remedies.append(
            'stamps differ by more than approximate_sync_tolerance_seconds, or queue_size is too '
            'small' if approximate else
            'no stamp came on all four topics: set approximate_sync if the cameras do not stamp '
            'alike, or a larger queue_size')
    return '; '.join([report, *remedies])


def _median_and_percentile(name, milliseconds):
    median, high = np.percentile(milliseconds, (50, 95))
    return {f'{name}, median': f'{median:.1f} ms', f'{name}, 95th percentile': f'{high:.1f} ms'}
