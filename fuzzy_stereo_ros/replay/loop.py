# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The loop over a bag: match every pair in order and pass the results to the sinks.

While a pair is matched, one thread reads the next pair and another writes the previous one.
"""
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
import signal
import time

from fuzzy_stereo_ros.matching.plausibility import PlausibilityCheck
from fuzzy_stereo_ros.matching.row_offsets import Misalignment
from fuzzy_stereo_ros.pair_matcher import camera_of, MatchedPair, without_missing
from fuzzy_stereo_ros.pairs.stereo_pair import Calibration, kind_of
from fuzzy_stereo_ros.program import catching
from fuzzy_stereo_ros.replay.source import Rejection, rejection_of


@dataclass
class Stats:
    """Statistics of a replay."""

    matched: int = 0        # new pairs
    rematched: int = 0      # pairs that were matched only to warm up
    warm: int = 0           # of both, those that started from the previous pair
    rejected: Counter = field(default_factory=Counter)      # by reason
    first_rejection: str = ''                               # sentence
    remarks: dict = field(default_factory=dict)             # on calibrations and files, by kind
    milliseconds: float = 0.0       # of matching, in all
    seconds: float = 0.0            # of the loop
    log_time: int | None = None     # ns, as stamp: of the last matched pair
    stamp: int | None = None
    interrupted: bool = False       # by the user
    error: Exception | None = None  # DamagedBag, OSError or ValueError that ended it
    segments: int = 0               # that were matched
    workers: int = 0                # most at a time, 0 if this process matched
    misalignment: Misalignment | None = None    # of the rows of the pairs so far
    plausibility: PlausibilityCheck = field(default_factory=PlausibilityCheck)
    findings: dict = field(default_factory=dict)            # sentences of this check, by cause
    calibration: Calibration | None = None      # of the last matched pair

    def reject(self, rejection, what, log):
        """Count and log a Rejection; what: the rejected thing in words, such as 'message'."""
        self.rejected[rejection.reason] += 1
        self.first_rejection = self.first_rejection or rejection.sentence
        log(f'{what} rejected: {rejection.sentence}')

    def note(self, remark, log):
        """Keep and log a remark if it is the first of its kind."""
        if self.remarks.setdefault(kind_of(remark), remark) is remark:
            log(remark)


def match_in_order(items, matcher):
    """Yield each Item with its Match, its Rejection, or None; the next Item is read meanwhile."""
    with ThreadPoolExecutor(1, 'reader') as reader:
        next_item = reader.submit(next, items, None)
        while (item := next_item.result()) is not None:
            next_item = reader.submit(next, items, None)
            if item.went_back:
                matcher.reset()
            yield item, match_or_reject(item.pair, matcher)


def match_or_reject(pair, matcher):
    """Return the Match of a StereoPair, or its Rejection; a Rejection or None as it is."""
    if pair is None or isinstance(pair, Rejection):
        return pair
    try:
        return matcher.match(pair.left, pair.right, stamp=pair.stamp, camera=camera_of(pair))
    except ValueError as error:
        return rejection_of(error)
    except Exception as error:          # noqa: B902  an internal error ends no replay
        matcher.reset()                 # it may hold half of this pair
        return rejection_of(error)


def replay(results, outputs, stats, stopped, log, on_pair):
    """
    Write the results of all pairs, until the end, an error, or an interruption.

    results: of `match_in_order`. outputs: Outputs, which are closed in any case. stats: to be
    filled; its error is set by a damaged bag or a full disk. stopped(): whether to stop before
    the next pair. log(sentence): logs rejections and remarks. on_pair(): called after each pair.
    """
    started = time.perf_counter()
    with ThreadPoolExecutor(1, 'writer') as writer:
        writing = []
        try:
            for item, outcome in results:
                if stopped():
                    break
                matched = _count(item, outcome, outputs.config, stats, log)
                while writing:
                    _wait_for_write(writing.pop(), stats, log)
                if stats.error is not None:
                    break
                if matched is not None and not item.written:
                    writing.append(writer.submit(outputs.write, matched, item))
                if item.stamp is not None:
                    on_pair()
            if stats.error is None and not stopped():
                writing.append(writer.submit(outputs.finish))
        except (ValueError, OSError) as error:
            stats.error = error
        finally:
            stats.interrupted = stopped()
            writing.append(writer.submit(outputs.close))
            for one in writing:
                _wait_for_write(one, stats, log)
            stats.seconds = time.perf_counter() - started


def _wait_for_write(writing, stats, log):
    """Wait for a Future of a write; count its Rejection, keep the first error, log later ones."""
    try:
        rejection = writing.result()
        if rejection is not None:
            stats.matched -= 1
            stats.reject(rejection, 'results', log)
    except (ValueError, OSError) as error:
        if stats.error is None:
            stats.error = error
        else:
            log(str(error))


def _count(item, outcome, config, stats, log):
    """Add an Item and its outcome to Stats; return its MatchedPair, None if it has no Match."""
    if item.went_back:
        log('timestamps jumped back; matcher reset')
    if isinstance(outcome, Rejection):
        what = 'message' if item.stamp is None else f'pair {item.stamp / 1e9:.3f}'
        stats.reject(outcome, what, log)
    if outcome is None or isinstance(outcome, Rejection):
        return None
    for remark in item.pair.calibration.remarks:
        stats.note(remark, log)
    calibration = replace(item.pair.calibration, remarks=())
    if calibration != (stats.calibration or calibration):
        stats.note('the calibration changed; calibration.json of --files is the one of the last '
                   'pairs', log)
    stats.calibration = calibration
    stats.milliseconds += outcome.times['total']
    stats.warm += outcome.warm
    stats.rematched += item.written
    stats.matched += not item.written
    stats.log_time, stats.stamp = item.log_time, item.stamp
    match = without_missing(outcome, item.pair.missing)
    stats.misalignment = match.misalignment or stats.misalignment
    finding = stats.plausibility.add_within_share(
        item.pair.left, item.pair.right, match, config,
        calibration.offset if calibration.focal else None)
    if finding is not None and finding.cause not in stats.findings:
        stats.findings[finding.cause] = finding.sentence
        log(finding.sentence)
    return MatchedPair(item.pair, match, config)


def interruption():
    """Return a context of whether SIGINT came, see `catching`; a second: KeyboardInterrupt."""
    def act(times):
        if times > 1:
            raise KeyboardInterrupt
    return catching(signal.SIGINT, act)
