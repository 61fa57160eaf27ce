# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The loop over a bag: every pair is matched, in order, and given to the sinks.

One thread reads the next pair and another writes the last one while a pair is matched.
"""
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
import signal
import threading
import time

from fuzzy_stereo_ros.pair_matcher import camera_of, MatchedPair, without_missing
from fuzzy_stereo_ros.pairs.epipolar import EpipolarCheck
from fuzzy_stereo_ros.pairs.stereo_pair import Calibration, kind_of
from fuzzy_stereo_ros.replay.source import Rejection, rejection_of


@dataclass
class Stats:
    """
    How a replay went.

    matched: pairs that are new; again: those matched to warm up. warm: of all these, how many
    started from the pair before. rejected: by reason; first_rejection: its sentence. remarks: on
    calibrations and files, by kind. milliseconds: of matching, of all. seconds: of the loop.
    logged, stamp: ns, of the last pair that was matched; None before. interrupted: whether it was
    stopped. error: what ended it, a DamagedBag, OSError or ValueError; or None. segments: how
    many were matched; workers: how many matched them at the most, 0 where this process matched.
    epipolar: whether the rows of the images fit. calibration: of the last pair.
    """

    matched: int = 0
    again: int = 0
    warm: int = 0
    rejected: Counter = field(default_factory=Counter)
    first_rejection: str = ''
    remarks: dict = field(default_factory=dict)
    milliseconds: float = 0.0
    seconds: float = 0.0
    logged: int | None = None
    stamp: int | None = None
    interrupted: bool = False
    error: Exception | None = None
    segments: int = 0
    workers: int = 0
    epipolar: EpipolarCheck = field(default_factory=EpipolarCheck)
    calibration: Calibration | None = None

    def reject(self, rejection, what, log):
        """Count and log the Rejection of what: a message, a pair, or the results of one."""
        self.rejected[rejection.reason] += 1
        self.first_rejection = self.first_rejection or rejection.sentence
        log(f'{what} rejected: {rejection.sentence}')

    def note(self, remark, log):
        """Keep and log a remark, the first of its kind."""
        if self.remarks.setdefault(kind_of(remark), remark) is remark:
            log(remark)


def match_in_order(steps, matcher):
    """
    Yield (Step, its Match, Rejection or None) of each Step, the next being read meanwhile.

    matcher: a StereoMatcher.
    """
    with ThreadPoolExecutor(1, 'reader') as reader:
        coming = reader.submit(next, steps, None)
        while (step := coming.result()) is not None:
            coming = reader.submit(next, steps, None)
            if step.went_back:
                matcher.reset()
            yield step, match_or_reject(step.pair, matcher)


def match_or_reject(pair, matcher):
    """Return the Match of a StereoPair by a StereoMatcher, or a Rejection; those as they are."""
    if pair is None or isinstance(pair, Rejection):
        return pair
    try:
        return matcher.match(pair.left, pair.right, stamp=pair.stamp, camera=camera_of(pair))
    except ValueError as error:
        return rejection_of(error)
    except Exception as error:          # noqa: B902  whatever it is, the next pair is matched
        matcher.reset()                 # which may hold half of this pair
        return rejection_of(error)


def replay(results, outputs, stats, stopped, log, on_pair):
    """
    Write what was matched, until the end, an error, or until it is stopped.

    results: yields (Step, Match, Rejection or None). outputs: Outputs, closed in any case. stats:
    Stats to be filled. stopped(): whether to stop before the next pair. log(sentence): of each
    rejected pair and each remark on a calibration. on_pair(): called after each pair.
    stats.error is what a damaged bag or a full disk raised.
    """
    started = time.perf_counter()
    with ThreadPoolExecutor(1, 'writer') as writer:
        writing = []
        try:
            for step, outcome in results:
                if stopped():
                    break
                matched = _counted(step, outcome, outputs.config, stats, log)
                while writing:
                    _wait(writing.pop(), stats, log)
                if stats.error is not None:
                    break
                if matched is not None and not step.again:
                    writing.append(writer.submit(outputs.put, matched, step.logged))
                if step.stamp is not None:
                    on_pair()
            if stats.error is None and not stopped():
                writing.append(writer.submit(outputs.finish))
        except (ValueError, OSError) as error:
            stats.error = error
        finally:
            stats.interrupted = stopped()
            writing.append(writer.submit(outputs.close))
            for one in writing:
                _wait(one, stats, log)
            stats.seconds = time.perf_counter() - started


def _wait(writing, stats, log):
    """Wait for what is being written; count a Rejection, keep the first error, log others."""
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


def _counted(step, outcome, config, stats, log):
    """Count a Step and return its MatchedPair, None where it was not matched."""
    if step.went_back:
        log('timestamps jumped back; matcher reset')
    if isinstance(outcome, Rejection):
        what = 'message' if step.stamp is None else f'pair {step.stamp / 1e9:.3f}'
        stats.reject(outcome, what, log)
    if outcome is None or isinstance(outcome, Rejection):
        return None
    for remark in step.pair.calibration.remarks:
        stats.note(remark, log)
    calibration = replace(step.pair.calibration, remarks=())
    if calibration != (stats.calibration or calibration):
        stats.note('the calibration changed: calibration.json, where there is one, is that of the '
                   'last pairs', log)
    stats.calibration = calibration
    stats.milliseconds += outcome.times['total']
    stats.warm += outcome.warm
    stats.again += step.again
    stats.matched += not step.again
    stats.logged, stats.stamp = step.logged, step.stamp
    match = without_missing(outcome, step.pair.missing)
    stats.epipolar.watch(step.pair, match)
    return MatchedPair(step.pair, match, config, None)


@contextmanager
def interruption():
    """
    Give a function that returns whether SIGINT has come; a second one raises KeyboardInterrupt.

    Outside the main thread, where Python allows no handlers, nothing is noted.
    """
    came = []

    def note(number, frame):
        if came:
            raise KeyboardInterrupt
        came.append(number)

    if threading.current_thread() is not threading.main_thread():
        yield lambda: False
        return
    before = signal.signal(signal.SIGINT, note)
    try:
        yield lambda: bool(came)
    finally:
        signal.signal(signal.SIGINT, before)
