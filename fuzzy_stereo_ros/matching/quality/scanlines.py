# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Scanline optima from eight directions, along the surface of a parent.

Not in the paper: see kernels/scanlines/eight_directions.py.
"""
from typing import NamedTuple

from fuzzy_stereo_ros.matching.bands import cut_bands
from fuzzy_stereo_ros.matching.kernels.possibility.fuzzy_costs import FULL
from fuzzy_stereo_ros.matching.kernels.scanlines import eight_directions
import numpy as np

OVERLAP = 32         # rows beyond a band in which its paths start


class Smoothness(NamedTuple):
    """Penalties of a path for changes of disparity, in parts of FULL."""

    jump: float              # P2 where grey is flat
    small: float             # P1, as a share of P2
    at_edge: float           # share of both that is left at the strongest edges
    edge: float              # grey step at which the rest has fallen to 1 / e

    def weights(self):
        """Return the share of both penalties by grey step: float32 (256,)."""
        fall = np.exp(-np.arange(256) / self.edge)
        return (self.at_edge + (1 - self.at_edge) * fall).astype(np.float32)


class SurfaceScanlines:
    """Scanline optima for one image size: memory, and the chosen labels."""

    def __init__(self, shape):
        """shape: of the costs, (R, C, labels)."""
        rows, columns, padded = self._costs_shape = shape
        self._bands = cut_bands(rows)
        self._sums = []     # memory for the sums of bands, not in use now
        stride = padded + 2 * eight_directions.PAD
        self._paths = [np.zeros((2, 4, columns, stride), np.uint16) for _ in self._bands]
        self._least = [np.zeros((2, 4, columns), np.uint16) for _ in self._bands]
        self._offered = [np.zeros((2, columns + padded), np.uint16) for _ in self._bands]
        self._numbers = np.arange(padded, dtype=np.uint16)
        self.steps = np.zeros((4, rows, columns), np.uint8)
        self.labels, self.target = (np.zeros((rows, columns), np.int16) for _ in range(2))
        self.offsets = np.zeros((rows, columns), np.float32)
        self.margins = np.zeros((rows, columns), np.uint16)

    def set_colour(self, colour):
        """Set the colours of an image, uint8 (R, C, 3): jumps cost less at their edges."""
        signed = colour.astype(np.int16)

        def between(one, other):
            return np.abs(one - other).max(axis=2)
        self.steps[eight_directions.ACROSS, :, 1:] = between(signed[:, 1:], signed[:, :-1])
        self.steps[eight_directions.DOWN, 1:] = between(signed[1:], signed[:-1])
        self.steps[eight_directions.DOWN_RIGHT, 1:, 1:] = between(
            signed[1:, 1:], signed[:-1, :-1])
        self.steps[eight_directions.DOWN_LEFT, 1:, :-1] = between(
            signed[1:, :-1], signed[:-1, 1:])

    def search(self, pool, costs, disparities, smoothness, parent, steepest, here=slice(None)):
        """
        Choose labels: `labels`, `offsets`, `margins`, and `target`, those of the target's pixels.

        parent: int16 (R, C), the surface that paths follow; steepest: its largest step that
        counts; here: the rows whose labels are chosen
        """
        weights = FULL * smoothness.jump * smoothness.weights()
        small, jump = (np.rint(share * weights).astype(np.uint16)
                       for share in (smoothness.small, 1))
        rows = self._costs_shape[0]
        begin, end, _ = here.indices(rows)

        def search(band):
            number, first, last = band
            above, below = max(first - OVERLAP, 0), min(last + OVERLAP, rows) - 1
            first, last = max(first, begin), min(last, end)
            if first >= last:
                return
            memory = self._sums.pop() if self._sums else self._new_sums()
            sums = memory[:last - first]
            for upwards, start in ((False, above), (True, below)):
                eight_directions.sum_paths(
                    costs, parent, steepest, self.steps, small, jump, sums, upwards, start,
                    first, last, self._paths[number], self._least[number])
            eight_directions.choose_labels(
                sums, disparities, self._offered[number], self._numbers, self.labels,
                self.offsets, self.margins, self.target, first, last)
            self._sums.append(memory)
        pool.each(search, self._bands)

    def _new_sums(self):
        """Return memory for the sums of a band; each thread needs one."""
        return np.empty((max(last - first for _, first, last in self._bands),
                         *self._costs_shape[1:]), np.uint16)
