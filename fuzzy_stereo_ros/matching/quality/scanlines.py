# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Scanline optima from eight directions, along the surface of a parent, a strip of rows at a time.

Not in the paper: see kernels/scanlines/eight_directions.py. The costs of all matches and their
sums are large; only those of a strip, with rows around it, are in memory. Strips are cut by the
size of the images alone.
"""
from typing import NamedTuple

from fuzzy_stereo_ros.matching.bands import cut_bands
from fuzzy_stereo_ros.matching.kernels.possibility.fuzzy_costs import FULL, LONGEST
from fuzzy_stereo_ros.matching.kernels.scanlines import eight_directions
from fuzzy_stereo_ros.matching.quality.possibility import padded, ROUNDS, SupportPossibility
import numpy as np

OVERLAP = 32         # rows beyond a band in which its paths start
MOST_COSTS = 48_000_000      # of a strip with the rows around it
MOST_PIXEL_COSTS = 12_000_000    # of one in which nothing is searched
PIXEL_REACH = 8      # rows around a strip of pixel costs, more than their filters reach
# Weight of what steps cost by grey step, of which a tenth is left at the strongest edges; P2.
WEIGHTS = (0.1 + 0.9 * np.exp(-np.arange(256) / 20.0)).astype(np.float32)
JUMP = FULL * 3.0 * WEIGHTS


class SurfaceScanlines:
    """Scanline optima for one image size: the memory that they need."""

    def __init__(self, shape):
        """shape: of the costs, (R, C, labels)."""
        rows, columns, _ = self._costs_shape = shape
        self._bands = cut_bands(rows)
        self._sums = []     # memory for the sums of bands, not in use now
        self.steps = np.zeros((4, rows, columns), np.uint8)

    def set_colour(self, colour):
        """Set the colours of an image, uint8 (R, C, 3): jumps cost less at their edges."""
        signed = colour.astype(np.int16)

        def between(one, other):
            return np.abs(one - other).max(axis=2)
        self.steps[eight_directions.ALONG, :, 1:] = between(signed[:, 1:], signed[:, :-1])
        self.steps[eight_directions.DOWN, 1:] = between(signed[1:], signed[:-1])
        self.steps[eight_directions.DOWN_RIGHT, 1:, 1:] = between(
            signed[1:, 1:], signed[:-1, :-1])
        self.steps[eight_directions.DOWN_LEFT, 1:, :-1] = between(
            signed[1:, :-1], signed[:-1, 1:])

    def search(self, pool, costs, disparities, small, parent, steepest, chosen, here=slice(None)):
        """
        Choose the labels of least sum of all paths, of the rows `here`.

        pool: a ThreadPool; costs: uint16 (R, C, labels), of matches, the first `disparities` of
        them count; small: P1 as a share of P2; parent, steepest: see `ParentSurface`; chosen: see
        `choose_labels`
        """
        small, jump = (np.rint(share * JUMP).astype(np.uint16) for share in (small, 1))
        rows = self._costs_shape[0]
        begin, end, _ = here.indices(rows)
        of_band = max(last - first for _, first, last in self._bands), *self._costs_shape[1:]

        def search(band):
            _, first, last = band
            above, below = max(first - OVERLAP, 0), min(last + OVERLAP, rows) - 1
            first, last = max(first, begin), min(last, end)
            if first >= last:
                return
            memory = self._sums.pop() if self._sums else np.empty(of_band, np.uint16)
            sums = memory[:last - first]
            for upwards, start in ((False, above), (True, below)):
                eight_directions.sum_paths(
                    costs, (parent, steepest), (self.steps, small, jump), sums, upwards, start,
                    first)
            eight_directions.choose_labels(sums, disparities, chosen, first)
            self._sums.append(memory)
        pool.each(search, self._bands)


class Strip(NamedTuple):
    """Some rows of an image, and those that are in memory for them."""

    rows: slice
    around: slice        # with those around them
    here: slice          # the rows of the strip among these


def cut_strips(rows, costs_a_row, reach, most=MOST_COSTS):
    """Return the fewest `Strip`s with `reach` rows around that fit, and their height in memory."""
    for count in range(1, rows + 1):
        inner = -(-rows // count)
        height = min(inner + 2 * reach, rows)
        if height * costs_a_row <= most or inner <= reach:
            break
    strips = []
    for first in range(0, rows, inner):
        begin, last = min(max(first - reach, 0), rows - height), min(first + inner, rows)
        strips.append(Strip(slice(first, last), slice(begin, begin + height),
                            slice(first - begin, last - begin)))
    return strips, height


class ScanlineStrips:
    """
    Memory for one image size, and the scanline optima of the last search.

    labels: int16, margins: uint16, offsets: float32 (R, C), target: int16 (R, extra + C), see
    `choose_labels`; strips: list of `Strip`; steps: uint8 (2, R, C), of grey to the left and
    upwards
    """

    def __init__(self, rows, columns, disparities, lowest):
        """Allocate for images of a size and a range of disparities from `lowest` on."""
        reach = OVERLAP + LONGEST * ROUNDS
        self.strips, height = cut_strips(rows, columns * padded(disparities), reach)
        self._disparities = disparities
        self._possibility = SupportPossibility(height, columns, disparities, lowest)
        self._scanlines = SurfaceScanlines(self._possibility.costs.shape)
        shape = rows, columns
        self.labels, self.target = (np.zeros((rows, width), np.int16) for width in (
            columns, self._possibility.extra + columns))
        self.margins = np.zeros(shape, np.uint16)
        self.offsets = np.zeros(shape, np.float32)
        self.steps = np.zeros((2, *shape), np.uint8)

    def set_pair(self, left, right, surface):
        """Set a pair and its parent's surface, see `SupportPossibility.fill`."""
        self._pair, self._surface, self._strip = (left, right), surface, None

    def fill(self, pool, strip):
        """Return the costs of a strip and the rows around it, uint16: see SupportPossibility."""
        if self._strip != strip:
            self._strip = strip
            left, right = (tuple(part[strip.around] for part in image) for image in self._pair)
            self._scanlines.set_colour(left[0])
            self.steps[:, strip.rows] = self._scanlines.steps[::2, strip.here]
            self._possibility.fill(pool, left, right, self._surface[strip.around])
        return self._possibility.costs

    def search(self, pool, strip, prior, small, parent, steepest):
        """Choose the labels of a filled strip by a prior; others: see SurfaceScanlines."""
        surface, weights, *zones = prior
        given = pool, surface[strip.around], weights[strip.around], *zones
        chosen = (every[strip.around] for every in (
            self.labels, self.offsets, self.margins, self.target))
        self._possibility.add_prior(*given)
        self._scanlines.search(pool, self._possibility.costs, self._disparities, small,
                               parent[strip.around], steepest, tuple(chosen), strip.here)
        self._possibility.add_prior(*given, undo=True)


def pixel_costs(pool, left, right, disparities, lowest):
    """Return costs without supports: uint8 (R, C, labels); see `SupportPossibility.fill`."""
    rows, columns = left[1].shape
    labels = padded(disparities)
    volume = np.empty((rows, columns, labels), np.uint8)
    strips, height = cut_strips(rows, columns * labels, PIXEL_REACH, MOST_PIXEL_COSTS)
    possibility = SupportPossibility(height, columns, disparities, lowest)
    for strip in strips:
        possibility.fill(
            pool, *(tuple(part[strip.around] for part in image) for image in (left, right)))
        costs, kept = possibility.costs[strip.here], volume[strip.rows]

        def keep(band, costs=costs, kept=kept):
            np.minimum(costs[band[1]:band[2], :, :labels] >> 1, 255,
                       out=kept[band[1]:band[2]], casting='unsafe')
        pool.each(keep, cut_bands(len(kept)))
    return volume
