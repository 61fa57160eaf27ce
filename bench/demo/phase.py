# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
A phase of the demo: publish pairs of a sequence at a rate, and compute figures of the results.

The sequence is a window that pans over the Motorcycle pair of scikit-image, with ground truth.
"""
from dataclasses import dataclass, field
from itertools import pairwise
import time

from bench.datasets import cropped, read_motorcycle
from fuzzy_stereo_ros.evaluation.report import Table
from fuzzy_stereo_ros.evaluation.scores import flicker, mean, score
from fuzzy_stereo_ros.pairs.messages import stamp_of
import numpy as np

ROWS, COLUMNS = 480, 640    # of the window
STEP = 2                    # px, horizontal motion per frame
TIMEOUT = 5.0               # s without any result, after which pairs count as lost
NOT_MATCHED = 'pairs dropped', 'pairs rejected'     # keys of the node's diagnostics
WAITING = 'pairs waiting'   # another key; includes the pair that is being matched


class MotorcycleWindow:
    """
    A window that pans over the Motorcycle pair of scikit-image.

    focal: px. baseline: metres. offset: px, cx of the left camera minus that of the right one; it
    is the disparity at infinity.
    """

    focal = 994.978
    baseline = 0.193001
    offset = -31.086

    def __init__(self):
        self._pair = read_motorcycle()

    def place(self, number):
        """Return the first column and row of the window, which reverses at the borders."""
        rows, columns = self._pair.truth.shape
        return (_back_and_forth(STEP * number, columns - COLUMNS),
                _back_and_forth(number // 2, rows - ROWS))

    def frame(self, number):
        """Return the `ScoredPair` of the window in a frame."""
        return cropped(self._pair, ROWS, COLUMNS, *self.place(number))


def _back_and_forth(distance, length):
    """Return the position after a distance on a path from 0 to length and back, repeatedly."""
    position = distance % (2 * length)
    return min(position, 2 * length - position)


@dataclass
class Phase:
    """
    The figures of one run, `warm` or `cold`.

    published: number of pairs. dropped: number of pairs that the node counts as dropped or
    rejected. seconds: from the first pair published to the last result received. latencies: ms
    from stamp to receipt of each result. scores, flickers: of each result, percent.
    """

    name: str
    published: int = 0
    dropped: int = 0
    seconds: float = 0.0
    latencies: list = field(default_factory=list)
    scores: list = field(default_factory=list)
    flickers: list = field(default_factory=list)

    @property
    def received(self):
        """The number of disparity images received."""
        return len(self.latencies)

    @property
    def lost(self):
        """The number of pairs that were neither received nor counted by the node."""
        return self.published - self.received - self.dropped

    def add_scores(self, received, sequence):
        """
        Add the scores and the flicker of results.

        received: list of (frame number, disparity) as of `play`. sequence: a MotorcycleWindow.
        """
        self.scores += [score(disparity, sequence.frame(number).truth)
                        for number, disparity in received]
        for (last, before), (number, after) in pairwise(received):
            across, down = np.subtract(sequence.place(last), sequence.place(number)).tolist()
            self.flickers.append(flicker(before, after, (down, across)))


def play(listener, cameras, sequence, phase, frames, rate, progress=lambda: None):
    """
    Publish the first frames of a sequence, rate a second, and count in a `Phase`.

    Return a list of (frame number, disparity) once every pair is received, counted by the node or
    lost. disparity: float32 (R, C), pixels of the images, NaN = invalid.
    listener: a `Listener`. cameras: SimulatedCameras. progress(): called after each change.
    """
    sent, received, not_matched_before = {}, [], _not_matched(listener)

    def take(message):
        number = sent.pop(stamp_of(message.header), None)
        if number is not None:
            phase.latencies.append(listener.ages[-1])
            phase.seconds = time.monotonic() - start
            values = floats(message.image)      # without the sequence's offset
            values[values < message.min_disparity] = np.nan
            received.append((number, values + np.float32(sequence.offset)))

    listener.take, start = take, time.monotonic()
    last_change = start
    while time.monotonic() - last_change < TIMEOUT + 1 / rate:
        counts = phase.published, phase.received
        due = start + phase.published / rate - time.monotonic()
        if phase.published == frames or due > 0:
            listener.spin(0.1 if phase.published == frames else min(0.1, due))
        else:
            shown = sequence.frame(phase.published)
            sent[cameras.publish(shown.left, shown.right)] = phase.published
            phase.published += 1
        if counts != (phase.published, phase.received) or listener.counts[WAITING]:
            last_change = time.monotonic()
            progress()
        phase.dropped = _not_matched(listener) - not_matched_before
        if phase.published == frames and phase.lost <= 0:
            break
    return received


def floats(image):
    """Return the values of a 32FC1 sensor_msgs/Image, as a copy: float32 (R, C)."""
    return np.frombuffer(image.data, '<f4').reshape(image.height, image.width).copy()


def _not_matched(listener):
    return sum(listener.counts[name] for name in NOT_MATCHED)


FIGURES = {
    'pairs published': lambda phase: phase.published,
    'disparity images received': lambda phase: phase.received,
    'pairs dropped and counted by the node': lambda phase: phase.dropped,
    'pairs lost': lambda phase: phase.lost,
    'latency, median [ms]': lambda phase: _milliseconds(phase.latencies, 50),
    'latency, 95th percentile [ms]': lambda phase: _milliseconds(phase.latencies, 95),
    'rate [pairs/s]': lambda phase: phase.received / max(phase.seconds, 1e-9),
    'density [%]': lambda phase: mean(found.density for found in phase.scores),
    'bad-1, of the published disparities [%]':
        lambda phase: mean(found.bad_sparse[1.0] for found in phase.scores),
    'bad-2, of the published disparities [%]':
        lambda phase: mean(found.bad_sparse[2.0] for found in phase.scores),
    'bad-1 or invalid, of all pixels [%]':
        lambda phase: mean(found.bad_dense[1.0] for found in phase.scores),
    'bad-2 or invalid, of all pixels [%]':
        lambda phase: mean(found.bad_dense[2.0] for found in phase.scores),
    'flicker: pixels that change by more than 1 px [%]': lambda phase: mean(phase.flickers)}


def table(phases):
    """Return the figures of the phases as a Markdown table, a column for each phase."""
    return Table('', ('', *(phase.name for phase in phases)), [
        (name, *(figure(phase) for phase in phases)) for name, figure in FIGURES.items()]).markdown


def _milliseconds(latencies, percentile):
    return f'{np.percentile(latencies, percentile):.1f}' if latencies else None
