# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The population of the profile `realtime`, and its operator: mutation by planes.

The paper mutates the least possible cells by patches. Here the least certain cells are those of
plain walls, whose matches are ambiguous: a region of similar grey takes the plane that fits most
of its consistent matches, as the segments of `quality` do (Bleyer and Gelautz, 2005). Crossover
with the mutant takes the regions that are fitter.
"""
from itertools import pairwise

from fuzzy_stereo_ros.matching.arrays import zeros
from fuzzy_stereo_ros.matching.bands import MOST_PARTS
from fuzzy_stereo_ros.matching.kernels.planes import segments
from fuzzy_stereo_ros.matching.kernels.refinement import filling
import numpy as np

LIKENESS = segments.Likeness(step=768, apart=384, overlap=6)    # of half-size pixels
LEAST_REGION = 60    # half-size pixels of a region
MOST_POINTS = 200    # of a region, at most, that its plane is fitted to
PARTS = 8            # of the regions, of as many points each, for threads
PLANES_TRIED, AGREEMENT, ENOUGH = 24, np.float32(0.7), 0.9  # of RandomPlanes
ON_PLANE_SHARE = 0.6  # of a region's points that must lie within 1 px of its plane


class Population:
    """
    One chromosome, a map of labels, whose inconsistent cells are filled from the background.

    genes: uint8 or uint16 (1, R, C), labels; fitness: float64 (1,), higher is fitter; best: 0;
    converged: whether it was crossed with a mutant
    """

    best = 0

    def __init__(self, fitness, labels):
        """Allocate genes like labels, (R, C); fitness: the `CensusFitness` of the pairs."""
        self._measure = fitness
        self.genes = zeros((1, *labels.shape), labels.dtype)
        self.fitness, self.converged = zeros(1), True

    def fill(self, labels, validity, band):
        """
        Fill the inconsistent cells of a band with background genes of their rows.

        labels: (R, C); validity: uint8 (R, C), which of them are consistent
        """
        filling.fill_rows(labels, validity, self.genes[0], band[1], band[2])

    def measure(self, pool, after=None):
        """Measure the fitness; pool: a ThreadPool, or a Chain; after: a stage of it."""
        self.fitness = self._measure.measure(pool, self.genes[0], after=after)
        self.converged = False

    def accept(self, pool, crossover, random, mutant):
        """Take the genes of a mutant, (R, C) labels, that a crossover chooses."""
        self.fitness[0] += self._measure.cross(pool, crossover, random, self.genes[0], mutant)
        self.converged = True


class GreyRegions:
    """
    Regions of like grey in half-size pictures of one size.

    number: of those grown
    """

    def __init__(self, rows, columns):
        """Allocate for half-size pictures of a size."""
        self._begin, self._end, self._parent, self._size, self._region = (
            zeros(rows * columns, np.int32) for _ in range(5))
        self._row_runs = zeros((rows, 2), np.int32)
        self._sums = zeros((MOST_PARTS, 2, columns + 1), np.int32)

    def grow(self, pool, luminance, weak, likeness, least, after=None):
        """
        Grow the regions of a picture.

        pool: a ThreadPool, or a Chain; luminance: uint16, the picture with a margin; weak: uint8
        (r, c or more), where regions may lie; likeness: a `Likeness`, of runs; least: pixels of a
        region; after: a stage of the chain. The mark of this stage is returned.
        """
        runs, likeness = (self._begin, self._end, self._parent, self._row_runs), tuple(likeness)
        bands = pool.parts(len(self._row_runs))

        def join(edges):
            segments.join_runs(luminance, likeness, runs, self._sums[0], edges)
            self.number = segments.number_regions(runs, least, self._size, self._region)
        pool.each(lambda band: segments.find_runs(
            luminance, weak, likeness, runs, self._sums[band[0]], band[1], band[2]),
            bands, after)
        return pool.each(join, [np.array([first for _, first, _ in bands])])

    @property
    def grown(self):
        """The fields of their `Regions`, as kernels take them, and how many there are."""
        return (self._begin, self._end, self._row_runs, self._region), self.number


def parts_of_regions(starts):
    """
    Return PARTS parts of regions as (first, last), for threads, of about as many points each.

    starts: int32 (n + 1,), the first point of each region and the one behind all
    """
    edges = np.searchsorted(starts, starts[-1] * np.arange(PARTS) / PARTS).tolist()
    return list(pairwise([*edges, len(starts) - 1]))


class WeakRegions:
    """
    The mutation by planes of plain regions, of one image size.

    mutant: uint8 or uint16 (R, C), the labels of the chromosome that `mutate` writes
    """

    def __init__(self, possibility, labels_type):
        """Allocate for the size of the `CensusPossibility` of full images; labels of a type."""
        rows, columns = possibility.rows, possibility.columns
        self._possibility, self._regions = possibility, GreyRegions(rows // 2, columns // 2)
        pixels, most = (rows // 2) * (columns // 2), (rows // 2) * (columns // 2) // LEAST_REGION
        self._waited, self._places = (zeros((MOST_PARTS, most), np.int32) for _ in range(2))
        self._every, self._starts = zeros(most, np.int32), zeros(most + 1, np.int32)
        self._points = zeros((3, pixels), np.float32)
        self._planes = zeros((most, 3), np.float32)
        self.mutant = zeros((rows, columns), labels_type)

    def grow(self, pool, luminance, weak):
        """
        Grow the regions of a picture, as `GreyRegions.grow` does.

        pool: a ThreadPool, or a Chain; luminance: uint16, the half-size picture with a margin;
        weak: uint8 (r, c), where texture is weak
        """
        self._regions.grow(pool, luminance, weak, LIKENESS, LEAST_REGION, after=0)

    def count(self, validity, band):
        """
        Count the matches of the regions in a band of rows, once the regions are grown.

        validity: uint8 (R, C), which labels are consistent, in the rows of the band
        """
        regions, number = self._regions.grown
        index, first, last = band
        segments.count_matches(
            regions, validity, self._waited[index, :number], first // 2, last // 2)

    def place(self, pool):
        """
        Place the points of the regions among those of all, once all bands are counted.

        pool: a ThreadPool, or a Chain, whose mark of this stage is returned
        """
        def place(bands):
            number = self._regions.number
            starts = self._starts[:number + 1]
            segments.place_points(MOST_POINTS, bands, self._waited, self._every[:number],
                                  self._places, starts)
            self._parts = parts_of_regions(starts)
        return pool.each(place, [len(pool.parts(len(self.mutant)))])

    def gather(self, pool, chosen, validity, after=None):
        """
        Gather matches of the regions.

        pool: a ThreadPool, or a Chain; chosen, validity: the `SearchResult`, and which of its
        labels are consistent; after: the stage that places them
        """
        matches = chosen.labels, chosen.offsets, validity

        def gather(band):
            index, first, last = band
            segments.gather_points(
                self._regions.grown[0], self._every, self._waited[index], self._places[index],
                matches, self._points, first // 2, last // 2)
        pool.each(gather, pool.parts(len(validity)), after)

    def mutate(self, pool, parent, random):
        """
        Write a chromosome whose regions lie in planes of the matches, once these are gathered.

        pool: a ThreadPool, or a Chain; parent: (R, C) labels, the other genes
        """
        rules = PLANES_TRIED, AGREEMENT, ENOUGH, random.key

        def fit(part):
            segments.fit_planes(
                self._points, self._starts, rules, ON_PLANE_SHARE, self._planes,
                *self._parts[part])

        def write(band):
            _, first, last = band
            self.mutant[first:last] = parent[first:last]
            segments.write_mutant(
                self._regions.grown[0], self._planes, self._possibility.disparities,
                self._possibility.target_range, self.mutant, first // 2, last // 2)
        pool.each(fit, range(PARTS))
        pool.each(write, pool.parts(len(parent), 2))

    def operators(self, pool, crossover):
        """
        Return the operators of a generation, as `evolve` takes them: crossover with the mutant.

        pool: a ThreadPool; crossover: see matching/crossover.py
        """
        return {'planes': lambda population, random: population.accept(
            pool, crossover, random, self.mutant)}


class NotMutated:
    """No mutation of regions, in the place of WeakRegions or PlainRegions."""

    def __init__(self, *_):
        """Need no memory."""

    def grow(self, *_, after=None):
        """Grow no regions."""

    find = split = count = place = gather = mutate = grow

    def operators(self, *_):
        """Return no operators."""
        return {}
