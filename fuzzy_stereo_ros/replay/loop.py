# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The loop over a bag: every pair is matched, in order, by the same Rig that the node has.

One thread beside it reads the next pair and writes the last one while a pair is matched.
"""
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
import time

from fuzzy_stereo_ros.replay.sinks import BagSink
from fuzzy_stereo_ros.reports import kind_of


@dataclass
class Tally:
    """
    How a replay went.

    matched: pairs that are new; again: those matched to warm up. warm: of all these, how many
    started from the pair before. refused: by reason; first_refusal: why, in a sentence. remarks:
    on the calibration, by kind. milliseconds: of matching, of all. seconds: of the loop.
    logged, stamp: ns, of the last pair that was matched; None before. interrupted: whether it was
    stopped. error: what ended it, a DamagedBag, OSError or ValueError; or None. segments: how
    many there were; workers: how many matched them at the most, 0 where this process matched.
    """

    matched: int = 0
    again: int = 0
    warm: int = 0
    refused: Counter = field(default_factory=Counter)
    first_refusal: str = ''
    remarks: dict = field(default_factory=dict)
    milliseconds: float = 0.0
    seconds: float = 0.0
    logged: int | None = None
    stamp: int | None = None
    interrupted: bool = False
    error: Exception | None = None
    segments: int = 0
    workers: int = 0

    def note(self, remark, told):
        """Keep a remark and tell it, where there was none of its kind before."""
        if self.remarks.setdefault(kind_of(remark), remark) is remark:
            told(remark)


class Outputs:
    """
    The sinks, made by the thread that uses them when there is something for them.

    sinks: a list; None while there are none. written: pairs that all of them took. logged: ns, of
    the last of these.
    """

    def __init__(self, open_sinks):
        """Make nothing yet; open_sinks(): returns the list of sinks."""
        self._open_sinks, self.sinks, self.written, self.logged = open_sinks, None, 0, None

    def put(self, step, matched):
        """Give the copies of a Step and its Matched, None where there is none, to the sinks."""
        if matched is None and not step.copies:
            return
        if self.sinks is None:
            self.sinks = self._open_sinks()
        for sink in self.sinks:
            if isinstance(sink, BagSink):
                sink.advance(step.copies, step.logged)
            if matched is not None and not step.again:
                sink.take(matched)
        if matched is not None and not step.again:
            self.written += 1
            self.logged = step.logged

    def close(self):
        """Close all sinks and return the OSErrors of those that cannot be closed."""
        errors = []
        for sink in self.sinks or ():
            try:
                sink.close()
            except OSError as error:
                errors.append(error)
        return errors


def replay(source, rig, outputs, tally, stopped, told, shown):
    """
    Match what a source gives, until its end, an error, or until it is stopped.

    source: ReplaySource. rig: Rig, warmed up. outputs: Outputs. tally: Tally to be filled.
    stopped(): whether to stop before the next pair. told(sentence): of each refused pair and each
    remark on a calibration. shown(): called after each pair.
    What a bag or a disk does wrong ends in tally.error; the sinks are closed in any case.
    """
    started = time.perf_counter()
    steps, going = source.steps(), None
    with ThreadPoolExecutor(1, 'bag') as helper:
        try:
            coming = helper.submit(next, steps, None)
            while (step := coming.result()) is not None:
                if stopped():
                    tally.interrupted = True
                    break
                coming = helper.submit(next, steps, None)
                matched = _match(step, rig, tally, told)
                if going is not None:
                    going.result()
                going = helper.submit(outputs.put, step, matched)
                if step.stamp is not None:
                    shown()
        except (ValueError, OSError) as error:
            tally.error = error
        finally:
            _finish(helper, going, outputs, tally, told)
            tally.seconds = time.perf_counter() - started


def _match(step, rig, tally, told):
    """Return the Matched of a Step, None where it has no pair or a bad one; count it."""
    if step.went_back:
        rig.forget()
        told('the stamps went back: starting anew')
    try:
        if step.refusal is not None:
            raise step.refusal
        if step.pair is None:
            return None
        matched = rig.match_pair(step.pair)
    except ValueError as error:
        tally.refused[getattr(error, 'reason', 'match')] += 1
        tally.first_refusal = tally.first_refusal or str(error)
        what = 'message' if step.stamp is None else f'pair {step.stamp / 1e9:.3f}'
        told(f'{what} refused: {error}')
        return None
    for remark in matched.pair.calibration.remarks:
        tally.note(remark, told)
    tally.milliseconds += matched.match.times['total']
    tally.warm += matched.match.warm
    tally.again += step.again
    tally.matched += not step.again
    tally.logged, tally.stamp = step.logged, step.stamp
    return matched


def _finish(helper, going, outputs, tally, told):
    """Wait for what is being written and close the sinks; note and tell what goes wrong then."""
    closing, errors = helper.submit(outputs.close), []
    try:
        if going is not None:
            going.result()
    except (ValueError, OSError) as error:
        errors.append(error)
    for error in errors + closing.result():
        tally.error = tally.error or error
        if error is not tally.error:
            told(str(error))
