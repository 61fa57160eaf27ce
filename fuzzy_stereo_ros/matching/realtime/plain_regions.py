# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The mutation of plain regions by the evidence of all of their pixels.

Not in the paper, which mutates cell by cell. A plain wall has texture too faint for any window:
noise, JPEG or a vignette hide it from census and gradient. All pixels of the wall together still
determine its disparity. A region takes the plane that its pixels vote for where their evidence
exceeds that of the half-size map. The plane is written into that map and is a prior of the full
search, which so uses the same evidence. Regions that single windows can match are left alone: of
most pictures nothing is computed but where they are.

No estimate of noise is needed. A region is split into halves in many ways, and each half elects a
disparity of its own: if the evidence is chance, they differ. Halves are of whole columns, since
columns of a sensor differ. A map found by chance is as often consistent as not, so that
inconsistent pixels tell how much of a map is right.
"""
from functools import partial
from typing import NamedTuple

from fuzzy_stereo_ros.matching.arrays import zeros
from fuzzy_stereo_ros.matching.bands import MOST_PARTS, SHORT, widened
from fuzzy_stereo_ros.matching.kernels.planes import plain_regions as kernels, plain_texture
from fuzzy_stereo_ros.matching.kernels.planes.election import elect, Election, FACTS, Votes
from fuzzy_stereo_ros.matching.kernels.simd import LANES
from fuzzy_stereo_ros.matching.realtime.operators import GreyRegions
import numpy as np

PLAIN_STEP = 1.4     # grey levels over 2 px of a smoothed picture, below which it is plain
BURNT = 254          # grey levels; burnt out from here on
NEAREST = 3          # px of disparity; below it vignette, dust and the sensor's pattern match
LEAST_REGION = 0.01  # of the picture, for a region to vote
ANY_GREY = 2**17, 1  # likeness of the plain pixels of a region, see find_runs
CLIP, LEAST_CLIP = 3.75, 12   # of mean sizes at which a band is clipped; in 1/64 grey level


class Texture:
    """
    The faint texture of one view in every other row.

    plain: a `PlainMask`, where the half-size view is plain; bands: its `TextureBands`
    """

    def __init__(self, view, half_view, behind):
        """Allocate for a view at full and at half size; behind: elements to read behind it."""
        self.view, self.half, rows = view, half_view, half_view.rows
        columns = 2 * plain_texture.COLUMNS_AROUND + view.columns + max(behind, LANES)
        self._offset = view.columns - 2 * half_view.columns if view.mirrored else 0
        self.plain = plain_texture.PlainMask(
            zeros((rows, half_view.columns + LANES), np.uint8), zeros((rows, 2), np.int32))
        self.bands = plain_texture.TextureBands(
            zeros((plain_texture.BANDS, rows, columns), np.int16),
            zeros((rows, columns), np.uint16), zeros((rows, 2), np.int64))
        self._totals = zeros((MOST_PARTS, plain_texture.BANDS, 2), np.int64)

    def mark(self, first, last):
        """Mark the plain pixels of some rows, once all of the half-size view is read."""
        plain_texture.plain_mask(self.half.luminance, self.half.columns, BURNT << 8,
                                 int(64 * PLAIN_STEP), tuple(self.plain), first, last)

    def split(self, existing, band):
        """
        Split the texture of a band of rows into bands.

        The rows that it depends on are marked; existing: the columns of the view that exist
        """
        plain_texture.split(
            self.view.luminance, tuple(self.plain), self._offset, existing, tuple(self.bands),
            self._totals[band[0]], *band[1:])

    def quantise(self, band):
        """Quantise a band of rows, once all are split."""
        clips = np.array([max(CLIP * size // max(count, 1), LEAST_CLIP)
                          for size, count in self._totals.sum(axis=0).tolist()], np.int64)
        plain_texture.quantise(self.bands.values, self.bands.written, clips, *band[1:])


class PairRegions(NamedTuple):
    """
    The plain regions of a pair.

    places, starts: of number_cells; pieces, begins: of list_pieces; cells: see `Votes`; planes:
    float64 (cells, 3), see write_planes; certainty: uint8 (cells,), of the map, or of the plane
    taken
    """

    places: np.ndarray
    starts: np.ndarray
    pieces: np.ndarray
    begins: np.ndarray
    cells: np.ndarray
    planes: np.ndarray
    certainty: np.ndarray


class PlainRegions:
    """The mutation of one image size and its memory."""

    def __init__(self, views, min_disparity):
        """Allocate for the `Views` of pairs; min_disparity: px, that of label 0."""
        full, half = views.full, views.half
        rows, columns, disparities = half.rows, half.columns, full.disparities
        self._disparities, self._half_disparities = disparities, half.disparities
        self._nearest = max(NEAREST - min_disparity, 0)
        self._labels = -(-disparities // LANES) * LANES
        self._left = Texture(full.left, half.left, 0)
        self._right = Texture(full.right, half.right, self._labels + 1)
        self._regions = GreyRegions(
            rows, columns, ANY_GREY, max(int(LEAST_REGION * rows * columns), 1))
        self._cells = -(-rows // kernels.CELL_ROWS), -(-2 * columns // kernels.CELL_COLUMNS)
        end = full.left.columns - 1
        first, last = end - full.target_range[1], end - full.target_range[0]
        self._existing = (0, end), (max(first, 0), min(last, full.right.columns - 1))
        self._found = self._votes = self._election = None

    def find(self, pool):
        """Find the plain regions of the left view."""
        left = self._left
        pool.each(lambda band: left.mark(*band[1:]), self._parts(pool, SHORT))
        self._regions.grow(pool, left.half.luminance, left.plain.mask)
        pool.each(self._list, [self._cells])

    def mutate(self, pool, half):
        """
        Give the plain regions that windows do not match the planes that they vote for.

        half: the `SmallResult`, whose labels, prior of the full search and certainty are written
        """
        left, right, bands = self._left, self._right, self._parts(pool, SHORT)

        def judge_map(found):
            number = kernels.judge_map(found.pieces, found.starts, half.labels, half.validity,
                                       *found[4:])
            self._votes = self._new_votes(found) if number else None

        def split(band):
            right.mark(*widened(band, plain_texture.MEAN_REACH, len(right.plain.mask)))
            for texture, existing in zip((left, right), self._existing):
                texture.split(existing, band)

        def vote(band):
            for texture in (left, right):
                texture.quantise(band)
            plain_texture.vote(self._pieces(band), left.bands.values, right.bands.values,
                               right.bands.seen, self._votes.curves, self._votes.counts)

        def write(band):
            found, pieces = self._found, self._pieces(band)
            kernels.write_planes(
                pieces, found.planes, found.certainty, half.labels, self._half_disparities - 1,
                tuple(half.prior), self._disparities - 1, half.certainty)
        pool.each(lambda _: self._found and judge_map(self._found), [0])
        for stage, items in ((split, self._parts(pool)), (vote, bands), (self._judge, [0])):
            pool.each(partial(self._if_voting, stage), items)
        pool.each(lambda band: self._found and write(band), bands)

    def _new_votes(self, found):
        """Return the `Votes` of regions, none cast yet."""
        cells = len(found.cells)
        return Votes(np.zeros((cells, plain_texture.BANDS, self._labels), np.int16),
                     np.zeros((cells, self._labels), np.int16), found.cells)

    def _judge(self, _):
        """Have the regions elect disparities, and judge the planes around them."""
        found, votes, number = self._found, tuple(self._votes), len(self._found.places)
        self._election = Election(
            *(np.empty((number, self._disparities), kind) for kind in (np.float64, np.bool_)),
            np.empty(number, np.int64), np.empty((number, FACTS)))
        elect(votes, found.places, self._nearest, tuple(self._election))
        kernels.judge(votes, found.places, found.starts, tuple(self._election), self._nearest,
                      found.planes, found.certainty)

    def _pieces(self, band):
        """Return the pieces of the regions found in a band of rows."""
        first, last = (self._found.begins[-(-row // kernels.CELL_ROWS)] for row in band[1:])
        return self._found.pieces[first:last]

    def _if_voting(self, work, item):
        """Call work(item) if windows do not match all plain regions of the pair."""
        if self._votes is not None:
            work(item)

    def _parts(self, pool, each=1):
        """Return parts of half-size rows, of whole cells: as many as of full-size rows."""
        return [(index, first // 2, last // 2) for index, first, last in pool.parts(
            self._left.view.rows, 2 * kernels.CELL_ROWS, each)]

    def _list(self, sides):
        """List the cells that the regions reach into; sides: rows and columns of cells."""
        regions, number = self._regions.regions, self._regions.number
        self._found = self._votes = None
        if number == 0:
            return
        places, starts = np.empty((number, *sides), np.int32), np.zeros(number + 1, np.int32)
        cells, pieces = kernels.number_cells(regions, places, starts)
        listed, begins = np.empty((pieces, 4), np.int32), np.zeros(sides[0] + 1, np.int64)
        kernels.list_pieces(regions, places, listed, begins)
        self._found = PairRegions(places, starts, listed, begins, np.zeros((cells, 5), np.int32),
                                  np.empty((cells, 3)), np.empty(cells, np.uint8))
