# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Evolution from frame to frame: each frame is one generation of a chromosome of planes.

Not in the paper. The chromosome lies on a grid of every other pixel of every other row. Its genes
are inherited from the previous frame, moved with the picture, in tiles that have not changed and
whose noise is averaged away; all other genes follow the map of this frame. A generation is, at
random, one of two. Mutation: regions of similar grey are grown by random thresholds, in the share
of the picture where doubt is greatest and the fewest planes were tried. Each region is proposed
the plane that fits most cells of the map of this frame; a minimum cut takes the fitter genes.
Crossover: by partition crossover with the map of this frame, which is the cold parent, regions in
which inherited genes are no longer fitter return to that map.
"""
from typing import NamedTuple

from fuzzy_stereo_ros.matching.arrays import zeros
from fuzzy_stereo_ros.matching.bands import beside, Chain, MOST_PARTS, widened
from fuzzy_stereo_ros.matching.crossover import Cut, Exchange
from fuzzy_stereo_ros.matching.evolution import Durations, evolve, Stopwatch
from fuzzy_stereo_ros.matching.kernels.genetic.exchange import list_cells
from fuzzy_stereo_ros.matching.kernels.planes import costs, grid, grid_labels
from fuzzy_stereo_ros.matching.kernels.planes.costs import (
    Demands, PlanePenalties, RegionSets, reject_unfounded)
from fuzzy_stereo_ros.matching.kernels.planes.fits import region_planes
from fuzzy_stereo_ros.matching.kernels.planes.grid import CellMap, FrameMap, Genes
from fuzzy_stereo_ros.matching.kernels.planes.grid_proposals import (
    choose_regions, list_chosen, mark_taken, propose_planes, rank_regions, reject_bent,
    select_stale)
from fuzzy_stereo_ros.matching.kernels.planes.segments import Likeness
from fuzzy_stereo_ros.matching.realtime.operators import GreyRegions, parts_of_regions
import numpy as np

MUTATION = 0.5           # share of the generations that propose planes; the others cross
PICTURE_PARTS = 4        # such a generation works on 1 / PICTURE_PARTS of the picture
QUIET, OLDEST = 0.5, 16  # planes evolve where this noise is left, or after so many frames
TANGENT_REACH, JUMP = 2, 1.5    # tangents: cells between which slopes are taken; px of a jump
CLEAR = 24               # margin of a label in the search from which there is no doubt
UNTRUSTED = 5            # trust in a match, of TRUSTED, that is hidden or not consistent
LARGEST_DIFFERENCE = 3.0  # largest difference of neighbours' planes that counts, px
SMOOTH = 0.18            # cost of 1 px of difference without an edge, in impossible matches
EDGE, LEAST_EDGE = 3.3, 0.005    # step of 16 * root of grey at which it falls to 1 / e; floor
DEMANDS = Demands(far=np.float32(0.5), price=0, least=100)   # of regions that move
RUN_STEPS = 256, 2048    # grey, in 1 / 256, by which a cell may differ from its run: from, to
RUN_APART = 0.3, 0.7     # share of it by which the means of joined runs may differ: from, to
RUN_OVERLAP, SMALLEST_REGION = 6, 40  # cells by which joined runs overlap; cells of a region
PLANES_TRIED, AGREEMENT = 20, 0.7  # random planes tried a region; px by which cells agree
ON_PLANE, LEAST_ON_PLANE = 1.0, 0.45    # px from a plane; share of a region's trusted cells there
STALE = 1.0              # px from the map of this frame at which evolved genes are crossed with it
NEW = 0.75               # px from a label at which an evolved gene replaces it
ROOT_PARTS = 64          # steps of a root of grey in the table
WRITING = 'set the map and write it'    # for Durations


class TileHistory(NamedTuple):
    """
    The tiles of the left picture compared with the previous frame.

    choices: int8, 0 where a tile stayed, 1 where it moved; strengths: uint8, 0 where it changed;
    ages: float32, frames averaged; noise: grey levels; shift: px by which the picture moved, down
    and right
    """

    choices: np.ndarray
    strengths: np.ndarray
    ages: np.ndarray
    noise: float
    shift: tuple


class FrameEvolution:
    """
    A population of one for one image size: the chromosome of planes.

    carried: its `Genes`; genes: float32 (1, r, c), their disparities, px, as the frame began;
    fitness: float64 (1,), by how much it is fitter than when inherited; best: 0; converged:
    whether there is nothing to evolve, since no tile is quiet
    """

    best = 0

    def __init__(self, possibility):
        """Allocate; possibility: the `CensusPossibility` of full images."""
        shape = self._shape = possibility.rows // 2, possibility.columns // 2
        of_planes = shape[0], 3, shape[1]
        cells, most = shape[0] * shape[1], shape[0] * shape[1] // SMALLEST_REGION + 1
        self._possibility = possibility
        self._highest = np.float32(possibility.disparities - 1)
        self._exchange = Exchange(*shape, 4)
        self._cut = Cut(*shape, 4)
        across, down, self._current, self._proposed = (zeros(shape, np.float32) for _ in range(4))
        self._penalties = PlanePenalties(across, down, np.float32(LARGEST_DIFFERENCE))
        self._map = CellMap(
            zeros(shape, np.float32), zeros(of_planes, np.float32),
            *(zeros(shape, np.bool_) for _ in range(2)))
        self._doubts = zeros(shape, np.uint8)
        self._proposal = zeros(of_planes, np.float32)
        self._trusted, self._selected = (zeros(shape, np.bool_) for _ in range(2))
        self._labels, self._numbers, self._old, self._new = (
            zeros(shape, np.int32) for _ in range(4))
        self._everywhere, self._grey_regions = np.ones(shape, np.uint8), GreyRegions(*shape)
        self._sets = RegionSets(zeros(shape, np.int32), *(
            zeros(cells + 1, kind) for kind in (np.int32, np.int64, np.int32)))
        self._pixels = zeros(cells, np.int32)
        self._points, self._planes = zeros(3 * cells, np.float32), zeros((most, 3), np.float32)
        self._known, self._starts = zeros((3, most), np.int64), zeros(most + 1, np.int32)
        self._chosen, self._ends = (zeros(most, np.int32) for _ in range(2))
        self._nearest = [(zeros(possibility.right.columns // 2 + 2, np.float32),
                          zeros(shape[1], np.int32)) for _ in range(MOST_PARTS)]
        self._lines = [(zeros((2, 4, shape[1] + 1), np.float32), zeros(shape[1], np.uint8))
                       for _ in range(MOST_PARTS)]
        self._roots = np.rint(ROOT_PARTS * np.sqrt(np.arange(256))).astype(np.int32)
        steps = np.arange(16 * ROOT_PARTS + 1) * (16 / ROOT_PARTS)
        self._by_step = np.float32(
            SMOOTH * costs.UNIT * np.maximum(np.exp(-steps / EDGE), LEAST_EDGE))
        # which states may keep: memory of its own
        self._unevolved = Genes(
            np.zeros(of_planes, np.float32), *np.zeros((2, *shape), np.uint8), None)
        self.carried, self.fitness, self.converged = None, zeros(1), True
        self._durations = Durations()

    @property
    def genes(self):
        """The disparities of the chromosome as the frame began: float32 (1, r, c), px."""
        return self._current[None]

    @property
    def operators(self):
        """The operators of a generation, as `evolve` takes them."""
        return {'region planes': self._propose_regions,
                'crossover with the map': self._cross_with_map}

    def inherit(self, pool, previous, history):
        """
        Inherit the genes of the previous frame; return whether any tile inherits.

        previous: its `Genes`, or None; history: the `TileHistory` of the picture
        """
        self._pool, self.fitness[:] = pool, 0
        down, right = (0, 0) if previous is None else map(int, previous.origin + history.shift)
        quiet = history.ages >= min((history.noise / QUIET)**2, OLDEST)
        self._quiet = (quiet & (history.strengths > 0)).astype(np.uint8)
        self.converged = previous is None or not self._quiet.any()
        origin = np.array([down & 1, right & 1], np.uint8)
        if self.converged:
            self.carried = self._unevolved._replace(origin=origin)
            return False
        self.carried = Genes(*map(np.empty_like, self._unevolved[:3]), origin)
        pool.each(lambda band: grid.move_genes(
            tuple(previous), history.choices, self._quiet, (down >> 1, right >> 1),
            tuple(self.carried), band[1], band[2]), self._bands)
        return True

    def evolve(self, chromosome, chosen, validity, views, random, budget, evolution_ms):
        """
        Evolve the inherited genes, and write them into the map of this frame; return the history.

        chromosome: (R, C) labels of the map, written; chosen, validity: the `SearchResult` and
        which of its labels are consistent, both written; views: the `Views` of the pair; random,
        budget: as `evolution.evolve` takes them; evolution_ms: most of it, 0 for one generation
        """
        if self.converged or not budget.in_time(self._durations[WRITING]):
            return []
        watch, found = Stopwatch(), tuple(FrameMap(
            chromosome, chosen.labels, chosen.offsets, validity))
        self._set_map(found, chosen.margins, views.half.left.luminance)
        watch.lap('set_map')
        history = evolve(self, self.operators, random, budget.reserving(
            self._durations[WRITING]).limited_to(evolution_ms), None, self._durations)
        watch.lap('generations')
        self._write(found, views.full.left.luminance)
        watch.lap('write')
        self._durations.record(WRITING, watch.times['set_map'] + watch.times['write'])
        return history

    def _set_map(self, frame_map, margins, half_luminance):
        """Set the map of this frame; genes that are not inherited follow it."""
        genes, cell_map, self._half_luminance = self.carried, self._map, half_luminance

        def follow(band):
            rows = band[1:]
            grid.sample_map(frame_map, margins, CLEAR, genes.origin, tuple(cell_map),
                            self._doubts, *widened(band, TANGENT_REACH, self._shape[0]))
            grid.edge_weights(half_luminance, self._roots, self._by_step, *self._penalties[:2],
                              *rows)
            grid.follow_map(tuple(cell_map), TANGENT_REACH, np.float32(JUMP), tuple(genes),
                            self._highest, self._current, *rows)
            grid.trust_visible(
                self._current, cell_map.consistent, genes.origin,
                self._possibility.target_range[0], self._nearest[band[0]], self._trusted, *rows)
        self._pool.each(follow, self._bands)

    def _write(self, frame_map, luminance):
        """Write the evolved genes into the map of this frame."""
        self._pool.each(lambda band: grid_labels.write_labels(
            tuple(self.carried), self._trusted, luminance, np.float32(NEW), self._highest,
            frame_map, self._lines[band[0]], *band[1:]), self._bands)

    def _propose_regions(self, population, random):
        """Mutate: propose to doubted regions the planes that fit the map of this frame."""
        if not _proposes_planes(random):
            return
        regions, number = self._grown(random)
        known, starts = self._known[:, :number], self._starts
        rank_regions(regions, self._doubts, self.carried.proposals, *known)
        cells, doubt, proposals = known
        order = np.argsort(-(1 + doubt / cells) / (1 + proposals / cells), kind='stable')
        number = choose_regions(order, cells, self._labels.size // PICTURE_PARTS,
                                self._chosen[:number], starts)
        region_pixels, planes = (starts[:number + 1], self._pixels), self._planes[:number]
        list_chosen(regions, self._chosen, region_pixels, self._ends[:number], self._labels,
                    self._selected, self.carried.proposals)
        tried = PLANES_TRIED, np.float32(AGREEMENT), 1.0, random.key

        def fit(part):
            first, last = part
            own = self._points[3 * starts[first]:3 * starts[last]].reshape(3, -1)
            region_planes(self._map.disparities, self._trusted, region_pixels, tried, own, planes,
                          first, last)
            reject_bent(planes[first:last], (starts[first:last + 1], self._pixels),
                        self._map.disparities, self._trusted, np.float32(ON_PLANE), LEAST_ON_PLANE,
                        self._selected)
        chain = Chain(self._pool)
        chain.each(fit, parts_of_regions(starts[:number + 1]))
        chain.each(lambda band: propose_planes(
            (self._labels, planes), self._quiet, self._highest, self._selected,
            (self._proposal, self._proposed), *band[1:]), self._bands)
        parents = (self.carried.planes, self._old), (self._proposal, self._new)
        self._measure(chain, parents)
        chain.run()
        reject_unfounded(
            self._labels, (self._current, self._old), (self._proposed, self._new), self._trusted,
            tuple(DEMANDS), tuple(self._sets), self._selected)
        self._accept(self._cut, random, parents, True)

    def _cross_with_map(self, population, random):
        """Cross: replace evolved genes by those of the map of this frame where that is fitter."""
        if _proposes_planes(random):
            return
        chain, found = Chain(self._pool), self._map
        chain.each(lambda band: select_stale(
            self.carried.evolved, self._current, found.disparities, np.float32(STALE),
            self._selected, *band[1:]), self._bands)
        parents = (self.carried.planes, self._old), (found.tangents, self._new)
        self._measure(chain, parents)
        chain.run()
        self._accept(self._cut.regions, random, parents, False)

    def _grown(self, random):
        """Return the regions of random thresholds, as `GreyRegions.grown`."""
        draws = random.uniform(2)
        step = int(RUN_STEPS[0] * (RUN_STEPS[1] / RUN_STEPS[0])**draws[0])
        apart = int(step * (RUN_APART[0] + (RUN_APART[1] - RUN_APART[0]) * draws[1]))
        self._grey_regions.grow(self._pool, self._half_luminance, self._everywhere,
                                Likeness(step, apart, RUN_OVERLAP), SMALLEST_REGION)
        return self._grey_regions.grown

    def _measure(self, chain, parents):
        """
        Write the costs of the matches of both parents, where selected.

        chain: a Chain whose stage before selects the same bands
        """
        features, largest = tuple(self._possibility.features), self._possibility.model.largest

        def measure(band):
            for parent in parents:
                grid.grid_costs(
                    features, largest, self._possibility.target_range, self.carried.origin,
                    (self._trusted, UNTRUSTED), self._selected, parent, *band[1:])
        chain.each(measure, self._bands, beside(self._bands))

    @property
    def _bands(self):
        """The parts of the grid for the threads of the pool."""
        return self._pool.parts(self._shape[0])

    def _accept(self, crossover, random, parents, evolved):
        """Take the genes of the second parent that a crossover chooses; evolved: their mark."""
        exchange = self._exchange
        exchange.set_size(list_cells(self._selected, exchange.all_cells))
        costs.fill_exchange(*parents, tuple(self._penalties), self._selected, self._numbers,
                            exchange.changes())
        self.fitness -= crossover(exchange, random) / (costs.UNIT * self._labels.size)
        costs.take_planes(*parents, exchange.cells, exchange.taken)
        mark_taken(exchange.cells, exchange.taken, evolved, self.carried.evolved)


class NothingInherited(FrameEvolution):
    """No evolution from frame to frame: each frame starts with a new chromosome of planes."""

    def inherit(self, pool, previous, history):
        """Take nothing that has evolved before."""
        return super().inherit(pool, None, history)


def _proposes_planes(random):
    """Return whether the generation of a `Random` proposes planes, instead of crossing."""
    return random.child(0).uniform(1)[0] < MUTATION
