# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
A phase of the demo: pairs of a real sequence published at a rate, what came back, and figures.

The sequence has ground truth and needs no download: a window pans over scikit-image's pair.
"""
from dataclasses import dataclass, field
import time
from typing import NamedTuple

from fuzzy_stereo_ros.evaluation.ground_truth import read_motorcycle
from fuzzy_stereo_ros.evaluation.report import mean, Table
from fuzzy_stereo_ros.evaluation.scores import flicker, score
from fuzzy_stereo_ros.pairs.messages import stamp_of
import numpy as np

ROWS, COLUMNS = 480, 640  # of the window
STEP = 2  # pixels per frame to the right or left
PATIENCE = 5.0  # s after which a pair that is not at work is lost
NOT_MATCHED = 'pairs dropped', 'pairs rejected'  # keys of the node's diagnostics
WAITING = 'pairs waiting'   # the one at work is among them


class WindowPair(NamedTuple):
    """
    What the window shows in one frame.

    left, right: uint8 (R, C, 3) BGR.
    truth: float32 (R, C), pixels, x_left - x_right, left-referenced, NaN = unknown.
    first_row, first_column: of the window in the whole images.
    """

    left: np.ndarray
    right: np.ndarray
    truth: np.ndarray
    first_row: int
    first_column: int


class MotorcycleWindow:
    """
    The Motorcycle pair of scikit-image by a window.

    focal: px. baseline: metres. offset: px, the left camera's principal point minus that of the
    right one; a disparity of the images minus it is zero at infinity.
    """

    focal = 994.978
    baseline = 0.193001
    offset = -31.086

    def __init__(self):
        self._pair = read_motorcycle()

    def frame(self, number):
        """Return the `WindowPair` of a frame; the window turns round at the images' borders."""
        rows, columns = self._pair.truth.shape
        row = _to_and_fro(number // 2, rows - ROWS)
        column = _to_and_fro(STEP * number, columns - COLUMNS)
        shown = (slice(row, row + ROWS), slice(column, column + COLUMNS))
        return WindowPair(np.ascontiguousarray(self._pair.left[shown]),
                          np.ascontiguousarray(self._pair.right[shown]),
                          self._pair.truth[shown], row, column)


def _to_and_fro(distance, length):
    """Return where something is that walks from 0 to length and back, again and again."""
    place = distance % (2 * length)
    return min(place, 2 * length - place)


@dataclass
class Phase:
    """
    What was seen while pairs were published in one way, `warm` or `cold`.

    published: pairs sent. dropped: pairs the node says it did not match, for whatever reason.
    latencies: ms from stamp to receipt, in order of receipt. seconds: from the first pair
    sent to the last receipt. scores, flickers: per received pair, percent.
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
        """How many disparity images came back."""
        return len(self.latencies)

    @property
    def lost(self):
        """How many pairs neither came back nor were counted as dropped."""
        return self.published - self.received - self.dropped

    def judge(self, received, sequence):
        """
        Add scores and flicker of what was received.

        received: list of (frame number, disparity), disparity as in `evaluation`, in pixels of
        the images. sequence: its frame(number) tells ground truth and place of the window.
        """
        before = None
        for number, disparity in received:
            shown = sequence.frame(number)
            self.scores.append(score(disparity, shown.truth))
            if before is not None:
                last, last_disparity = before
                shift = (last.first_row - shown.first_row,
                         last.first_column - shown.first_column)
                self.flickers.append(flicker(last_disparity, disparity, shift))
            before = shown, disparity


def play(listener, cameras, sequence, phase, frames, rate, progress=lambda: None):
    """
    Publish frames 0 to frames - 1 of a sequence, rate a second, and write the `Phase`.

    Return a list of (frame number, disparity), disparity float32 (R, C), pixels of the images,
    NaN = invalid, once every pair came back, was counted by the node or is lost. listener: a
    `Listener`; cameras: SimulatedCameras. progress: called when pairs went out or came back.
    """
    sent, received, before = {}, [], _not_matched(listener)

    def take(message):
        number = sent.pop(stamp_of(message.header), None)
        if number is not None:
            phase.latencies.append(listener.ages[-1])
            phase.seconds = time.monotonic() - start
            values = floats(message.image)      # smaller by the sequence's offset
            values[values < message.min_disparity] = np.nan
            received.append((number, values + np.float32(sequence.offset)))

    listener.take, start = take, time.monotonic()
    news = start
    while time.monotonic() - news < PATIENCE + 1 / rate:
        known = phase.published, phase.received
        due = start + phase.published / rate - time.monotonic()
        if phase.published == frames or due > 0:
            listener.spin(0.1 if phase.published == frames else min(0.1, due))
        else:
            shown = sequence.frame(phase.published)
            sent[cameras.publish(shown.left, shown.right)] = phase.published
            phase.published += 1
        if known != (phase.published, phase.received) or listener.counts[WAITING]:
            news = time.monotonic()
            progress()
        phase.dropped = _not_matched(listener) - before
        if phase.published == frames and phase.lost <= 0:
            break
    return received


def floats(image):
    """Return a copy of a 32FC1 image: float32 (R, C)."""
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
