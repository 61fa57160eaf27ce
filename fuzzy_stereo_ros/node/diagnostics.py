# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Publish the status of the node in /diagnostics, and make log lines about lost messages."""
from collections import Counter, deque
from dataclasses import fields
import threading
from typing import NamedTuple

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from fuzzy_stereo_ros.matching.row_offsets import (
    LIMIT, MEASURED, NOT_MEASURED, PAIRS_OF_SWING)
from fuzzy_stereo_ros.pairs.stereo_pair import UNCALIBRATED
from fuzzy_stereo_ros.parameters.table import ros_name
import numpy as np

LOADING = 'loading the kernels'
GLANCE, DETAILS = 'stereo matching', 'stereo matching, details'     # names of the two statuses
RECTIFICATION = 'rectification'
# Keys of the first status, in its order; all others are in the second.
AT_A_GLANCE = ('input rate', 'output rate', 'latency, median', 'latency, 95th percentile',
               'pairs dropped', 'pairs rejected', 'valid share', 'mean confidence', RECTIFICATION,
               'suspected fault')
RECENT = 200    # newest pairs, of which medians and percentiles are computed
# Why messages are lost or what to do, by the start of their keys in `counts_of`.
LOSSES = {
    'pairs dropped': 'newer pairs came first, or parameters were prepared; see scale and '
                     'disparity_range',
    'pairs rejected': 'see the errors above',
    'unmatched ': 'no messages of the same stamp on the other topics; see queue_size and '
                  'approximate_sync',
    'lost ': 'sent, but not received; see input_qos and config/fastdds.xml',
}


class State(NamedTuple):
    """What the node is doing."""

    loading: str = ''           # progress of the warm-up, '' once the kernels are warm
    idle: str = ''              # why there are no subscriptions, '' if there are
    silence: float = 0          # s without a pair if that is too long, else 0
    preparing: bool = False     # whether changed parameters are being prepared


class Diagnostics:
    """
    Publishes a level, a sentence and values in /diagnostics: what matters first, then the rest.

    values: {key: text} that were published last, in both statuses. rejected: Counter of rejected
    pairs by reason. calibration: Calibration of the newest pair.
    """

    def __init__(self, node, now):
        """Advertise /diagnostics; now: s, the start of the first rates."""
        self._node = node
        self._publisher = node.create_publisher(DiagnosticArray, '/diagnostics', 1)
        self.values, self.rejected, self.calibration = {}, Counter(), UNCALIBRATED
        self._rejection, self._first = '', (None, None)
        self._lock, self._times, self._match = threading.Lock(), deque(maxlen=RECENT), None
        self._counted, self._counts = now, {}

    def matched(self, match, **times):
        """
        Record a Match and further times in ms by name; may be called from any thread.

        latency: from the last message to publishing. age: from the stamp to publishing, by the
        node's clock. stamps apart: between the earliest and the latest stamp of the pair.
        """
        with self._lock:
            self._times.append({**times, **{
                'matching time' if stage == 'total' else f'time of {stage}': value
                for stage, value in match.times.items()}})
            self._match = match

    @property
    def misalignment(self):
        """The Misalignment of the rows of the newest pairs, None where it is unknown."""
        return self._match and self._match.misalignment

    def _rows(self, finding):
        """Return whether the rows are a fault, and what they are like; a Finding tells more."""
        found = self.misalignment
        if finding and finding.cause == 'rows':
            return False, finding.sentence
        if found is None:
            return False, NOT_MEASURED
        doubtful, told = found.warns, found.advice or 'OK'
        rig, first = (self.calibration, found.rows, found.columns), self._first
        if rig != first[0] and found.pairs >= PAIRS_OF_SWING and not finding:
            self._first = rig, found.terms
        elif rig == first[0] and not doubtful and (
                moved := found.deviation(first[1])) > LIMIT:
            doubtful, told = True, (f'recalibrate: the rows have moved by {moved:.1f} px since '
                                    'the start, as by a knock or heat; undone before matching')
        return doubtful and not (finding and finding.warns), told

    def reject(self, reason, sentence):
        """Count a rejected pair by its reason, and say why; may be called from any thread."""
        with self._lock:
            self.rejected[reason] += 1
            self._rejection = sentence

    def close(self):
        self._node.destroy_publisher(self._publisher)

    def publish(self, now, counts, values, state, finding=None, left_out=()):
        """Publish at a time in s; return what is wrong with the rows, '' for nothing."""
        rates = self.rates(now, counts)
        level, sentence = status_of(state, rates, self._rejection)
        doubtful, rows = self._rows(finding)
        calibration = self.calibration.remarks
        remarks = [
            finding and (finding.warns, finding.sentence),
            *((bool(self.calibration.baseline), remark) for remark in calibration),
            doubtful and (True, rows),
            left_out and (True, f"{', '.join(left_out)} cannot be made, though asked for: the "
                          'baseline is 0 m by the two camera_info')]
        told = not state.idle and level in ('OK', 'WARN')
        for warns, remark in filter(None, remarks if told else ()):
            level, sentence = 'WARN' if warns else level, f'{sentence}; {remark}'
        self.values = {**{key: str(count) for key, count in counts.items()},
                       'input rate': f"{rates['pairs synchronised']:.1f} pairs/s",
                       'output rate': f"{rates['pairs matched']:.1f} pairs/s", **values,
                       **self.figures(),
                       'suspected fault': finding.cause if finding else 'none',
                       **(self.misalignment.figures if self.misalignment else
                          {MEASURED: NOT_MEASURED} if self._match else {})}
        if self._match:
            self.values[RECTIFICATION] = rows
            self.values['calibration'] = '; '.join(calibration) or 'OK'
        details = [key for key in self.values if key not in AT_A_GLANCE]
        message = DiagnosticArray(status=[
            self._status(GLANCE, level, sentence, AT_A_GLANCE),
            self._status(DETAILS, 'OK', 'counts, times, and the newest match', details)])
        message.header.stamp = self._node.get_clock().now().to_msg()
        self._publisher.publish(message)
        return rows if doubtful else ''

    def _status(self, title, level, sentence, keys):
        name = self._node.get_fully_qualified_name()
        return DiagnosticStatus(
            level=getattr(DiagnosticStatus, level), message=sentence, name=f'{name}: {title}',
            hardware_id=name, values=[KeyValue(key=key, value=self.values[key])
                                      for key in keys if key in self.values])

    def rates(self, now, counts):
        """Return {key: change per second since the previous call} of counts at a time in s."""
        seconds = max(now - self._counted, 1e-9)
        rates = {key: (count - self._counts.get(key, 0)) / seconds
                 for key, count in counts.items()}
        self._counted, self._counts = now, dict(counts)
        return rates

    def figures(self):
        """Return {key: text} of rejections, times, and the newest match."""
        with self._lock:
            times, match = list(self._times), self._match
            figures = {f'rejected: {reason}': str(count)
                       for reason, count in sorted(self.rejected.items())}
        if match is None:
            return figures
        # A pair that reuses a result skips stages; their figures stay those of the pairs before.
        for name in dict.fromkeys(name for one in times for name in one):
            found = [one[name] for one in times if name in one]
            median, high = np.percentile(found, (50, 95))
            for what, value in (('last', found[-1]), ('median', median),
                                ('95th percentile', high)):
                figures[f'{name}, {what}'] = f'{value:.1f} ms'
        return {**figures, 'generations': str(match.generations),
                'warm start': str(bool(match.warm)).lower(),
                'result reused (static scene)': str(match.reused).lower(),
                'camera motion': match.motion or 'not estimated',
                'mean confidence': f'{float(np.mean(match.confidence)):.3f}',
                'valid share': f'{1 - float(np.mean(np.isnan(match.disparity))):.3f}'}


class LossReports:
    """Makes a line for the first loss of a kind at once, then at most one in each period."""

    def __init__(self, period=60.0):
        """Start with no losses; period: s, long, as a busy node drops pairs all the time."""
        self._period = period
        self._reported, self._when = {}, {}

    def lines(self, now, counts, last=False):
        """Return the lines to log at a time in s, of losses since the line before; last: all."""
        lines = []
        for kind, reason in LOSSES.items():
            lost = {key: count - self._reported.get(key, 0) for key, count in counts.items()
                    if key.startswith(kind) and count > self._reported.get(key, 0)}
            waits = kind in self._when and now - self._when[kind] < self._period
            if lost and (last or not waits):
                self._when[kind] = now
                self._reported.update({key: counts[key] for key in lost})
                numbers = ', '.join(f'{number} {key}' for key, number in lost.items())
                lines.append(f'{numbers} since the last report ({reason})')
        return lines


def counts_of(synchroniser, pairs, lost):
    """Return {key: number}; pairs synchronised = matched + dropped + rejected + waiting."""
    counts = {'pairs synchronised': synchroniser.matched, 'pairs matched': pairs['done'],
              'pairs dropped': pairs['dropped'], 'pairs rejected': pairs['failed'],
              'pairs waiting': pairs['pending'], 'stamps went back': synchroniser.jumps_back}
    for topic in synchroniser.topics:
        counts[f'received {topic}'] = synchroniser.received[topic]
        counts[f'unmatched {topic}'] = synchroniser.unmatched[topic]
        counts[f'lost {topic}'] = lost[topic]
    return counts


def status_of(state, rates, rejection=''):
    """Return (level, sentence) of a State; rates: of `counts_of`; rejection: the newest."""
    if state.loading:
        return 'STALE', state.loading
    if state.idle:
        return 'OK', state.idle
    if state.silence:
        return 'ERROR', f'no stereo pair for {state.silence:.0f} s'
    matched, rejected, dropped = (
        rates[f'pairs {how}'] for how in ('matched', 'rejected', 'dropped'))
    if rejected:
        return ('WARN' if matched else 'ERROR'), f'rejecting {rejected:.1f} pairs/s: {rejection}'
    if dropped > matched:
        return 'OK' if state.preparing else 'WARN', (
            f'matching {matched:.1f} pairs/s and dropping {dropped:.1f}'
            + (' while changed parameters are being prepared' if state.preparing else
               ': they come faster than they can be matched; see scale and disparity_range'))
    return 'OK', f'matching {matched:.1f} pairs/s'


def change_of(in_use, requested):
    """Return a text with the differences of a requested MatcherConfig from the one in use."""
    changes = [(ros_name(field.name), getattr(requested, field.name), getattr(in_use, field.name))
               for field in fields(in_use)]
    return ', '.join(f'{name} = {new} (in use: {old})'
                     for name, new, old in changes if new != old) or 'no difference'
