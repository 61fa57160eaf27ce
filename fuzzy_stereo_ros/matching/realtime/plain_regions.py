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
from itertools import pairwise
from typing import NamedTuple

from fuzzy_stereo_ros.matching.arrays import zeros
from fuzzy_stereo_ros.matching.bands import MOST_PARTS, SHORT, widened
from fuzzy_stereo_ros.matching.kernels.planes import plain_regions as kernels, plain_texture
from fuzzy_stereo_ros.matching.kernels.simd import LANES
from fuzzy_stereo_ros.matching.kernels.units import SURE
from fuzzy_stereo_ros.matching.realtime.operators import GreyRegions
import numpy as np

PLAIN_STEP = 1.4     # grey levels over 2 px of a smoothed picture, below which it is plain
BURNT = 254          # grey levels; burnt out from here on
NEAREST = 3          # px of disparity; below it vignette, dust and the sensor's pattern match
LEAST_REGION = 0.01  # of the picture, for a region to vote
ANY_GREY = 2**17, 1  # likeness of the plain pixels of a region, see find_runs
CLIP, LEAST_CLIP = 3.75, 12   # of mean sizes at which a band is clipped; in 1/64 grey level
GROUPS = 32          # of columns of cells, a power of 2: split into halves in GROUPS - 1 ways
VISIBLE = 0.3        # least share of visible pixels, of the most that any disparity has
APART = 3            # px from the best disparity; nearer ones count as the same
LEAST_LABELS = 2 * APART + 2  # that are visible, for an election
SAMPLES = 8          # wrong disparities that show the evidence of a cell by chance
CHANCE = 0.6         # share of splits whose halves agree on noise, in one region of fifty
AGREE = 1            # px by which the choice of a half may differ from that of the region
MATCHED = 0.9        # share of consistent pixels above which a region keeps its map
LEAD = 2.0           # deviations by which a plane must exceed what is consistent of the map
DECISIVE = 4.0       # mean deviations of the plane in 3 x 3 cells from which windows can match it
LENIENT = -2.5       # deviations by which the map may exceed the plane in cells that accept it


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

    places, starts: of number_cells; pieces, begins: of list_pieces; votes: a `Votes`; planes:
    float64 (cells, 3), see write_planes; certainty: uint8 (cells,), of the map, or of the plane
    taken
    """

    places: np.ndarray
    starts: np.ndarray
    pieces: np.ndarray
    begins: np.ndarray
    votes: kernels.Votes
    planes: np.ndarray
    certainty: np.ndarray


class Election(NamedTuple):
    """What each region elects, and the evidence."""

    deviations: np.ndarray   # float64 (regions, labels)
    means: np.ndarray        # float64 (regions,), of the deviations
    valid: np.ndarray        # bool (regions, labels), visible often enough
    spreads: np.ndarray      # float64 (regions, plain_texture.BANDS), deviations of each band
    best: np.ndarray         # int64 (regions,)
    shares: np.ndarray       # float64 (regions, 2), of halves that elect it, and of splits both of
    #                          whose halves do


def elect(votes, places, labels, nearest):
    """
    Return the `Election` of some regions.

    votes: a `Votes`; places: of number_cells; nearest: label from which on there is evidence
    """
    regions = len(places)
    totals = np.zeros((regions, GROUPS, plain_texture.BANDS, labels), np.int32)
    squares, seen = np.zeros(totals.shape[:3], np.int64), np.zeros((regions, labels), np.int32)
    kernels.sum_groups(tuple(votes), places, totals, seen, squares)
    valid = seen > VISIBLE * seen.max(1, keepdims=True)
    valid &= valid.sum(1, keepdims=True) >= LEAST_LABELS
    spreads = np.sqrt(squares.sum(1) / np.maximum(seen.sum(1, keepdims=True), 1)) + 1e-6
    scales = 1 / np.sqrt(np.maximum(seen, 1))
    groups = np.einsum('rgbl,rb,rl->rgl', totals, 1 / spreads, scales)
    deviations, allowed = groups.sum(1), valid & (np.arange(labels) >= nearest)
    best, shares = np.where(allowed, deviations, -np.inf).argmax(1), np.zeros((regions, 2))
    kernels.elect_by_halves(groups, squares.any(2), allowed, best, AGREE, shares)
    means = (deviations * valid).sum(1) / np.maximum(valid.sum(1), 1)
    return Election(deviations, means, valid, spreads, best, shares)


def consistency(found):
    """Return the share of the map that is consistent in regions, and that is right: float64."""
    pixels, *_, inconsistent = np.array([
        found.votes.cells[first:last].sum(axis=0) for first, last in pairwise(found.starts)]).T
    consistent = 1 - inconsistent / pixels
    return consistent, np.maximum(2 * consistent - 1, 0)


def judge_map(found):
    """Write how sure the map is in the cells of `PairRegions`; return whether any have to vote."""
    consistent, right = consistency(found)
    of_map = SURE * right / np.maximum(consistent, 0.5)     # of consistent pixels
    found.planes[:] = np.nan
    for region, (first, last) in enumerate(pairwise(found.starts.tolist())):
        found.certainty[first:last] = of_map[region]
    return not (consistent > MATCHED).all()     # not known in a dry run, which takes all branches


def judge(found, labels, nearest):
    """
    Write the planes that cells of regions take, and how sure these are.

    found: the `PairRegions`; labels, nearest: see `elect`
    """
    votes, election = found.votes, elect(found.votes, found.places, labels, nearest)
    consistent, right = consistency(found)
    of_plane = SURE * np.maximum(election.shares[:, 1] - CHANCE, 0) / (1 - CHANCE)
    for region, (first, last) in enumerate(pairwise(found.starts.tolist())):
        if consistent[region] > MATCHED or election.shares[region, 0] <= right[region]:
            continue
        best, mean, deviations = (values[region] for values in (
            election.best, election.means, election.deviations))
        others = np.arange(nearest, labels, max(labels // SAMPLES, 1))
        others = others[election.valid[region, others] & (abs(others - best) > APART)]
        curves = votes.curves[first:last, :, :labels] / election.spreads[region][:, None]
        seen = kernels.COUNTED * votes.counts[first:last, :labels].astype(np.float64)
        plane, lead = np.array([0.0, 0.0, between(deviations, best)]), np.zeros(len(seen))
        (evidence, known), decisive = kernels.compare(
            curves[:, 0] + curves[:, 1], seen, votes.cells[first:last],
            found.places[region] - np.int32(first), nearest, others, plane, lead)
        if (evidence - mean - consistent[region] * (known - mean) > LEAD
                and decisive < DECISIVE):
            accepted = lead > max(decisive - DECISIVE, LENIENT)
            found.planes[first:last][accepted] = plane
            found.certainty[first:last][accepted] = of_plane[region]


def between(deviations, best):
    """Return the best disparity between whole px, by the parabola of the five around it."""
    if best < 2 or best > deviations.size - 3:
        return float(best)
    a, b, c, d, e = deviations[best - 2:best + 3].tolist()
    slope, bend = (2 * e + d - b - 2 * a) / 10, (2 * a - b - 2 * c - d + 2 * e) / 14
    return float(best + min(max(-slope / (2 * min(bend, -1e-9)), -0.75), 0.75))


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
        self._found, self._voting = None, False

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

        def weigh(found):
            kernels.sum_cells(found.pieces, half.labels, half.validity, found.votes.cells)
            self._voting = judge_map(found)

        def split(band):
            right.mark(*widened(band, plain_texture.MEAN_REACH, len(right.plain.mask)))
            for texture, existing in zip((left, right), self._existing):
                texture.split(existing, band)

        def vote(band):
            for texture in (left, right):
                texture.quantise(band)
            votes = self._found.votes
            plain_texture.vote(self._pieces(band), left.bands.values, right.bands.values,
                               right.bands.seen, votes.curves, votes.counts)

        def write(band):
            found, pieces = self._found, self._pieces(band)
            kernels.write_planes(
                pieces, found.planes, found.certainty, half.labels, self._half_disparities - 1,
                tuple(half.prior), self._disparities - 1, half.certainty)
        pool.each(lambda _: self._found and weigh(self._found), [0])
        for stage, items in ((split, self._parts(pool)), (vote, bands), (lambda nearest: judge(
                self._found, self._disparities, nearest), [self._nearest])):
            pool.each(partial(self._if_voting, stage), items)
        pool.each(lambda band: self._found and write(band), bands)

    def _pieces(self, band):
        """Return the pieces of the regions found in a band of rows."""
        first, last = (self._found.begins[-(-row // kernels.CELL_ROWS)] for row in band[1:])
        return self._found.pieces[first:last]

    def _if_voting(self, work, item):
        """Call work(item) if windows do not match all plain regions of the pair."""
        if self._voting:
            work(item)

    def _parts(self, pool, each=1):
        """Return parts of half-size rows, of whole cells: as many as of full-size rows."""
        return [(index, first // 2, last // 2) for index, first, last in pool.parts(
            self._left.view.rows, 2 * kernels.CELL_ROWS, each)]

    def _list(self, sides):
        """List the cells that the regions reach into; sides: rows and columns of cells."""
        regions, number = self._regions.regions, self._regions.number
        self._found, self._voting = None, False
        if number == 0:
            return
        places, starts = np.empty((number, *sides), np.int32), np.zeros(number + 1, np.int32)
        cells, pieces = kernels.number_cells(regions, places, starts)
        listed, begins = np.empty((pieces, 4), np.int32), np.zeros(sides[0] + 1, np.int64)
        kernels.list_pieces(regions, places, listed, begins)
        votes = kernels.Votes(
            np.zeros((cells, plain_texture.BANDS, self._labels), np.int16),
            np.zeros((cells, self._labels), np.int16), np.zeros((cells, 5), np.int32))
        self._found = PairRegions(
            places, starts, listed, begins, votes, np.zeros((cells, 3)), np.zeros(cells, np.uint8))
