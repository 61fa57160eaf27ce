# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Whether both views show what a map matches: without that, a match has no confidence.

Not in the paper. Scanlines, priors and neighbours carry a disparity into places of which the pair
shows nothing: a covered lens, a burnt-out window. There the windows around the two pixels of a
match hold noise alone, or are clipped, and noise does not correlate. Windows with a clear signal
are left to the search: near a depth edge even right matches correlate little.
"""
from fuzzy_stereo_ros.matching.arrays import zeros
from fuzzy_stereo_ros.matching.kernels.refinement.consistency import (
    BLOCK, judge_blocks, reject_unseen, sum_blocks, SUMS)
import numpy as np

LEAST_CORRELATION = 0.33  # of 3 x 3 blocks; noise that a search has matched reaches .3
SIGNAL = 3.0         # times the noise, standard deviation, above which a window shows a signal
UNSEEN = 0.14        # grey levels at half size, standard deviation: of rounding
HALVED = 0.5         # share of the noise of a picture that is left at half size


class Evidence:
    """The evidence for the maps of one image size, and its memory."""

    def __init__(self, left, right, noises, shift=0):
        """Allocate for half-size `Picture`s; noises: of both; shift: px of matches to the left."""
        self._left, self._right, self._noises, self._shift = left, right, noises, shift
        blocks = -(-left.rows // BLOCK), -(-left.columns // BLOCK)
        self._sums, self._seen = zeros((*blocks, SUMS)), zeros(blocks, np.uint8)
        self._clipped = zeros((left.rows, left.columns), np.uint8)

    def sum_up(self, labels, band):
        """Add up the blocks that begin in a band of rows of a map, (R, C) labels."""
        first, last = (min(-(-row // (2 * BLOCK)), len(self._seen)) for row in band[1:])
        sum_blocks(labels, self._left.luminance, self._right.luminance,
                   self._shift, self._sums, self._clipped, first, last)

    def judge(self):
        """Decide of which blocks the pair shows something, once all are added up."""
        if not self._seen.size:     # of one row or column nothing is left at half size
            return
        clear = [SIGNAL**2 * ((HALVED * noise.level)**2 + UNSEEN**2) for noise in self._noises]
        judge_blocks(self._sums, (*clear, UNSEEN**2), LEAST_CORRELATION, self._seen)

    def reject(self, validity, weights, first, last):
        """Reject rows of validity, uint8 (R, C), without evidence, but where weights are VOTED."""
        if self._seen.size:
            reject_unseen(self._seen, self._clipped, weights, validity, first, last)
