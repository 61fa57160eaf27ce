# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The demo's figures and the table it prints."""
from dataclasses import dataclass, field

from fuzzy_stereo_ros.evaluation.report import mean, Table
from fuzzy_stereo_ros.evaluation.scores import flicker, score
import numpy as np


@dataclass
class Phase:
    """
    What was seen while pairs were published in one way, `warm` or `cold`.

    published: pairs sent. dropped: pairs the node says it did not match, for whatever reason.
    latencies: seconds from stamp to receipt, in order of receipt. seconds: from the first pair
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


ROWS = {
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
        (name, *(figure(phase) for phase in phases)) for name, figure in ROWS.items()]).markdown


def _milliseconds(seconds, percentile):
    return f'{1000 * np.percentile(seconds, percentile):.1f}' if seconds else None
