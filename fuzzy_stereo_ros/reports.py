# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the node says about itself: throttled sentences, figures, rates, how well it goes."""
from collections import Counter, deque
from dataclasses import fields
import re
import threading
import traceback

from fuzzy_stereo_ros.parameters.table import ros_name
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

    def due(self, now, last=False):
        """
        Return the lines for what was held back for a period; call it regularly.

        last: for all that was held back, however short.
        """
        lines = []
        with self._lock:
            for kind, (before, count, sentence) in self._kinds.items():
                if count and (last or now - before >= self._period):
                    lines.append(f'{sentence} ({count} times in the last {now - before:.0f} s)')
                    self._kinds[kind] = (now, 0, '')
        return lines


class Figures:
    """Figures of the pairs that were matched or refused; written by the worker, read anywhere."""

    def __init__(self):
        """Start with nothing counted."""
        self._lock = threading.Lock()
        self._times = deque(maxlen=RECENT)
        self._match = None
        self.refused = Counter()    # by reason

    def matched(self, match, **times):
        """
        Note a Match and more ms by name, which stand before its times by stage.

        latency: from the last message to the publishing. age: from the stamp to the publishing,
        by the node's clock. stamps apart: between the earliest and the latest stamp of the pair.
        """
        with self._lock:
            self._times.append({**times, **{
                f'time of {stage}': value for stage, value in match.times.items()}})
            self._match = match

    def refuse(self, reason):
        """Count a pair that was not matched, by a word for the reason."""
        with self._lock:
            self.refused[reason] += 1

    def values(self):
        """Return {key: text}: times by stage, latency, and what the newest match was like."""
        with self._lock:
            times, match = list(self._times), self._match
            values = {f'refused: {reason}': str(count)
                      for reason, count in sorted(self.refused.items())}
        if match is None:
            return values
        for name, last in times[-1].items():
            recent = [one[name] for one in times if name in one]
            median, high = np.percentile(recent, (50, 95))
            for what, value in (('last', last), ('median', median), ('95th percentile', high)):
                values[f'{name}, {what}'] = f'{value:.1f} ms'
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


def counts_of(synchroniser, pairs, lost):
    """
    Return {key: number} of a Synchroniser and of what its pairs came to, as in `Lane.counts`.

    lost: {topic: messages that the middleware lost}.
    pairs synchronised = matched + dropped + refused + waiting.
    """
    counts = {'pairs synchronised': synchroniser.matched, 'pairs matched': pairs['done'],
              'pairs dropped': pairs['dropped'], 'pairs refused': pairs['failed'],
              'pairs waiting': pairs['pending'], 'stamps went back': synchroniser.jumps_back}
    for topic in synchroniser.topics:
        counts[f'received {topic}'] = synchroniser.received[topic]
        counts[f'unmatched {topic}'] = synchroniser.unmatched[topic]
        counts[f'lost {topic}'] = lost[topic]
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
    matched, refused, dropped = (
        rates[f'pairs {how}'] for how in ('matched', 'refused', 'dropped'))
    if refused:
        return ('WARN' if matched else 'ERROR'), f'refusing {refused:.1f} pairs/s'
    if dropped > matched:
        return 'WARN', (f'matching {matched:.1f} pairs/s and dropping {dropped:.1f}: they come '
                        'faster than they can be matched; see scale and disparity_range')
    return 'OK', f'matching {matched:.1f} pairs/s'


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
