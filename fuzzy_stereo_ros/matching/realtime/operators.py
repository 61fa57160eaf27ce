# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The population of the profile `realtime`, and its operator: mutation by planes.

The paper mutates the least possible cells by patches. Here the least certain cells are those of
plain walls, whose matches are ambiguous: a region of similar grey takes the plane that fits most
of its consistent matches, as the segments of `quality` do (Bleyer and Gelautz, 2005). Crossover
with the mutant takes the regions that are fitter.
"""
from fuzzy_stereo_ros.matching.arrays import zeros
from fuzzy_stereo_ros.matching.bands import MOST_PARTS, SHORT
from fuzzy_stereo_ros.matching.kernels.planes import segments
from fuzzy_stereo_ros.matching.kernels.refinement import filling
import numpy as np

LIKENESS = 768, 6    # of half-size pixels, see find_runs
LEAST_REGION = 60    # half-size pixels of a region
MOST_POINTS = 200    # of a region, at most, that its plane is fitted to


class Population:
    """
    One chromosome, a map of labels, whose inconsistent cells are filled from the background.

    genes: uint8 or uint16 (1, R, C), labels; fitness: float64 (1,), higher is fitter; best: 0;
    converged: whether it was crossed with a mutant
    """

    best = 0

    def __init__(self, pool, fitness, crossover, labels):
        """
        Allocate genes like labels, (R, C).

        pool: a ThreadPool; fitness: the `CensusFitness` of the pairs; crossover: see
        matching/crossover.py
        """
        self._pool, self._measure, self._crossover = pool, fitness, crossover
        self.genes = zeros((1, *labels.shape), labels.dtype)
        self.fitness, self.converged = zeros(1), True

    def fill(self, chain, labels, validity):
        """
        Fill the inconsistent cells with background genes of their rows.

        labels: (R, C); validity: uint8 (R, C), which of them are consistent
        """
        return chain.each(lambda band: filling.fill_rows(
            labels, validity, self.genes[0], *band[1:]), chain.parts(len(labels)))

    def measure(self, chain, after=None):
        """Measure the fitness."""
        self.fitness = self._measure.measure(chain, self.genes[0], after=after)
        chain.each(self._begin, [False])

    def _begin(self, converged):
        self.converged = converged

    def propose(self, mutant, random):
        """Take the genes of a mutant, (R, C) labels, that crossover chooses."""
        self.fitness[0] += self._measure.cross(
            self._pool, self._crossover, random, self.genes[0], mutant)
        self.converged = True


class GreyRegions:
    """
    Regions of like grey in half-size pictures of one size.

    regions: runs and rows, see segments.py; number: of the regions grown
    """

    def __init__(self, rows, columns, likeness, least):
        """Allocate for half-size pictures; likeness: of runs; least: pixels of a region."""
        self._likeness, self._least = likeness, least
        self.regions = zeros((4, rows * columns), np.int32), zeros((rows, 2), np.int32)

    def grow(self, pool, luminance, weak, after=None):
        """
        Grow the regions of a half-size picture.

        luminance: uint16, with a margin; weak: uint8 (r, c or more), where regions may lie
        """
        bands = pool.parts(len(self.regions[1]))

        def join(edges):
            segments.join_runs(luminance, self._likeness, self.regions, edges)
            self.number = segments.number_regions(self.regions, self._least)
        pool.each(lambda band: segments.find_runs(
            luminance, weak, self._likeness, self.regions, *band[1:]), bands, after)
        return pool.each(join, [np.array([first for _, first, _ in bands])])


class WeakRegions:
    """
    The mutation by planes of plain regions, of one image size: an operator of `evolve`.

    mutant: uint8 or uint16 (R, C), the labels of the chromosome that `mutate` writes
    """

    def __init__(self, possibility, labels_type):
        """Allocate for the size of the `CensusPossibility` of full images; labels of a type."""
        self._possibility = possibility
        rows, columns = possibility.rows // 2, possibility.columns // 2
        self._regions = GreyRegions(rows, columns, LIKENESS, LEAST_REGION)
        most = rows * columns // LEAST_REGION
        self._counts, self._places = (zeros((MOST_PARTS, most), np.int32) for _ in range(2))
        self._every, self._starts = zeros(most, np.int32), zeros(most + 1, np.int32)
        self._points = zeros((3, rows * columns), np.float32)
        self._planes = zeros((most, 3), np.float32)
        self.mutant = zeros((possibility.rows, possibility.columns), labels_type)

    def __call__(self, population, random):
        """Propose the mutant to a population."""
        population.propose(self.mutant, random)

    @property
    def operators(self):
        """The operators of a generation, as `evolve` takes them."""
        return {'planes': self}

    def grow(self, chain, luminance, weak, after):
        """Grow the regions of a picture, where texture is weak, see `GreyRegions.grow`."""
        self._regions.grow(chain, luminance, weak, after)

    def mutate(self, chain, chosen, validity, parent, random, after):
        """
        Write a chromosome whose regions lie in planes of their matches.

        chosen: the `SearchResult`; validity: uint8 (R, C), which of its labels are consistent;
        parent: (R, C) labels, the other genes; after: the stage that writes validity
        """
        matches = chosen.labels, chosen.offsets, validity
        regions, bands = self._regions.regions, chain.parts(len(validity), each=SHORT)

        def count(band):
            segments.count_matches(regions, validity, self._counts[band[0], :self._regions.number],
                                   band[1] // 2, band[2] // 2)

        def place(bands):
            number = self._regions.number
            segments.place_points(
                MOST_POINTS, self._counts[:bands, :number], self._every[:number], self._places,
                self._starts[:number + 1])

        def gather(band):
            index, first, last = band
            segments.gather_points(regions, self._every, self._counts[index], self._places[index],
                                   matches, self._points, first // 2, last // 2)

        def fit(key):
            starts = self._starts[:self._regions.number + 1]
            segments.fit_planes(self._points, starts, key, self._planes)

        def write(band):
            _, first, last = band
            self.mutant[first:last] = parent[first:last]
            segments.write_mutant(
                regions, self._planes, self._possibility.disparities,
                self._possibility.target_range, self.mutant, first // 2, last // 2)
        chain.each(count, bands, after)
        chain.each(place, [len(bands)])
        chain.each(gather, bands)
        chain.each(fit, [random.key])
        chain.each(write, chain.parts(len(parent), 2, SHORT))


class NotMutated:
    """No mutation of regions, in the place of WeakRegions or PlainRegions."""

    operators = {}

    def __init__(self, *_):
        """Need no memory."""

    def grow(self, *_, after=None):
        """Grow no regions."""

    find = mutate = grow
