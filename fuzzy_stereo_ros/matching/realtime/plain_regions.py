# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The mutation of plain regions, whose evidence is the whole region.

Not in the paper, which mutates cell by cell. A plain wall has texture too faint for any window:
noise, JPEG or a vignette hide it from census and gradient. All pixels of the wall together still
tell its disparity. A region takes the plane that its pixels vote for where their evidence beats
that of the half-size map. It becomes a part of that map and a prior in the possibility of the full
search, which thereby sees the same evidence. What windows can tell by themselves is left to them.
"""
from fuzzy_stereo_ros.matching.bands import cut_bands, widened
from fuzzy_stereo_ros.matching.kernels.planes import plain_regions as kernels
from fuzzy_stereo_ros.matching.kernels.planes.region_votes import judge
from fuzzy_stereo_ros.matching.kernels.planes.segments import number_regions
from fuzzy_stereo_ros.matching.kernels.simd import LANES
import numpy as np

PLAIN = 1.4          # grey levels over 2 px of a smoothed picture, below which it is plain
BURNT = 254          # grey levels; burnt out from here on
NEAREST = 3          # px; nearer, vignette, dust and patterns of the sensor match
LEAST = 0.01         # of the picture, for a region to vote
CLIP, LEAST_CLIP = 3.75, 12   # of mean sizes at which a band is clipped; in 1/64 grey level
REACH = 3            # rows that a band depends on


class Texture:
    """
    The faint texture of one view in every other row.

    bands: int16 (BANDS, r, ...), seen: uint16 (r, ...), where it is plain: see plain_regions
    """

    def __init__(self, view, half_view, behind):
        """Allocate for a view at full and at half size; behind: elements to read behind it."""
        self.view, self.half, rows = view, half_view, half_view.rows
        columns = 2 * kernels.PAD + -(-view.columns // LANES) * LANES
        self._offset = view.columns - 2 * half_view.columns if view.mirrored else 0
        self.steps = np.zeros((rows, half_view.columns), np.uint16)
        self.mask = np.zeros(self.steps.shape, np.uint8)
        self.seen = np.zeros((rows, columns + behind), np.uint16)
        self._pictures = [np.zeros((rows, columns), np.uint16) for _ in range(5)]
        self.bands = np.zeros((kernels.BANDS, *self.seen.shape), np.int16)
        self._totals = np.zeros((len(cut_bands(rows, kernels.ROWS)), kernels.BANDS, 3), np.int64)

    def measure(self, band):
        """Measure how plain a band of rows is, once all of the half-size view is read."""
        kernels.flatness(self.half.luminance, self.half.columns, BURNT << 8, self.steps, *band[1:])

    def mark(self, band):
        """Mark the plain pixels of a band of rows, once all are measured."""
        kernels.plain_mask(self.steps, int(64 * PLAIN), self.mask, *band[1:])

    def split(self, inside, band):
        """Split the texture of a band into bands; inside: the columns of the view that exist."""
        (fine, medium, coarse, *across), columns = self._pictures, self.view.columns
        stride, mask = fine.shape[1], self.seen
        rows, fewer = (widened(band, reach, len(mask)) for reach in (REACH, REACH - 1))
        kernels.widen_mask(self.mask, self._offset, inside, mask, *rows)
        kernels.every_other_row(self.view.luminance, mask, columns, fine, *rows)
        kernels.mean_of_three(fine, mask, columns, 2, across[0], *rows)
        kernels.mean_of_three(across[0], mask, columns, stride, medium, *fewer)
        kernels.mean_of_three(medium, mask, columns, 4, across[1], *fewer)
        kernels.mean_of_three(across[1], mask, columns, 2 * stride, coarse, *band[1:])
        self._totals[band[0]] = 0
        for number, pictures in enumerate(((fine, medium), (medium, coarse))):
            kernels.subtract_means(*pictures, mask, columns, self.bands[number],
                                   self._totals[band[0], number], *band[1:])

    def quantise(self, sums, band):
        """Quantise a band of rows, once all are split; sums: of their sizes and counts."""
        for number, (size, count, _) in enumerate(sums):
            self._totals[band[0], number, 2] = kernels.quantise(
                self.bands[number], self.seen, self.view.columns,
                max(CLIP * size // max(count, 1), LEAST_CLIP), *band[1:])

    def sums(self):
        """Return sizes, counts and squares of each band of texture: [[int, int, int]]."""
        return self._totals.sum(axis=0).tolist()


class PlainRegions:
    """
    The mutation of one image size and its memory.

    figures: float64 (regions, 5), what decided on each region of the last pair, see judge
    """

    def __init__(self, views, min_disparity):
        """Allocate for the `Views` of pairs; min_disparity: px, that of label 0."""
        full, half = views.full, views.half
        rows, columns, disparities = half.rows, half.columns, full.disparities
        self._disparities, self._half_disparities = disparities, half.disparities
        self._nearest = max(NEAREST - min_disparity, 0)
        self._labels = -(-disparities // LANES) * LANES
        self._left = Texture(full.left, half.left, 0)
        self._right = Texture(full.right, half.right, self._labels + 1)
        self._bands = cut_bands(rows, kernels.ROWS)
        self._runs = tuple(np.zeros(rows * columns, np.int32) for _ in range(5))
        self._row_runs = np.zeros((rows, 2), np.int32)
        self._least = max(int(LEAST * rows * columns), 1)
        self._cells = -(-rows // kernels.ROWS), -(-2 * columns // kernels.COLUMNS)
        self._base = full.left.columns - 1
        self.figures = np.zeros((0, 5))

    def mutate(self, pool, inside, half_labels, prior, weight):
        """
        Give plain regions the planes that they vote for; return whether any takes one.

        inside: the first and the last column of the target that exist; half_labels: (r, c), the
        half-size map, and prior: the `Prior` of the full search, both written; weight: of the
        prior there
        """
        left, bands = self._left, self._bands
        pool.each(left.measure, bands)
        pool.each(left.mark, bands)
        begin, end, parent, size, region = self._runs
        kernels.mask_regions(left.mask, begin, end, parent, self._row_runs)
        number = number_regions(begin, end, parent, self._row_runs, self._least, size, region)
        if number == 0:
            return False
        regions = begin, end, self._row_runs, region
        planes, kept, places = self._vote(pool, inside, half_labels, regions, number)
        if np.isnan(planes[:, 0]).all():
            return False
        pool.each(lambda band: kernels.write_planes(
            *regions, places, kept, planes, self._half_disparities, half_labels,
            self._disparities, prior.labels, prior.weights, weight, *band[1:]), bands)
        return True

    def _vote(self, pool, inside, half_labels, regions, number):
        """Return the planes of regions, which of their cells take them, and the cells' places."""
        left, right, bands = self._left, self._right, self._bands
        pool.each(right.measure, bands)
        pool.each(right.mark, bands)
        first, last = self._base - inside[1], self._base - inside[0]
        columns = (0, left.view.columns - 1), (max(first, 0), min(last, right.view.columns - 1))

        def split(band):
            for texture, existing in zip((left, right), columns):
                texture.split(existing, band)
        pool.each(split, bands)
        places, starts = np.empty((number, *self._cells), np.int32), np.zeros(number + 1, np.int32)
        cells = kernels.list_cells(*regions, places, starts)
        curves = np.zeros((cells, kernels.BANDS, self._labels), np.int16)
        counts = np.zeros((cells, self._labels), np.int16)
        sums = np.zeros((cells, 4 + kernels.BANDS), np.int32)

        quantised = [(texture, texture.sums()) for texture in (left, right)]

        def vote(band):
            for texture, of_bands in quantised:
                texture.quantise(of_bands, band)
            kernels.vote(left.bands, right.bands, right.seen, *regions, places, half_labels,
                         self._base, curves, counts, sums, *band[1:])
        pool.each(vote, bands)
        planes, self.figures = np.empty((number, 3)), np.zeros((number, 5))
        kept = np.zeros(cells, np.uint8)
        power = np.array([square / max(count, 1) for _, count, square in right.sums()])

        def judge_region(region):
            judge(curves, counts, sums, places[region], starts[region], starts[region + 1],
                  self._disparities, self._nearest, power, planes[region], self.figures[region],
                  kept)
        pool.each(judge_region, range(number))
        return planes, kept, places
