# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The fitness of the profile `realtime`: possibility, smoothness and occlusion in one number.

Not in the paper: Eq. 3 prefers wrong maps, since it pays to point at strong edges. Here a
chromosome loses what its genes cost: matches that are little possible, jumps of disparity (less
at grey edges), and labels that contradict what the target image shows.
"""
from fuzzy_stereo_ros.matching.bands import cut_bands
from fuzzy_stereo_ros.matching.kernels.genetic import aimed_mutation, gene_cost
from fuzzy_stereo_ros.matching.kernels.partition import differing_cells, partition_crossover
import numpy as np

SMOOTHNESS = 4       # the passes' penalties are divided by this: they count four paths
HIDDEN = 6           # cost of a gene that something nearer hides
CONTRADICTED = 15    # cost of a gene that would hide what can be seen
ADVANTAGE = 1        # cost a cell by which a region must be fitter to be taken over
SAMPLE_STEP = 16     # every so many rows, and columns, are looked at where a sample will do


class CensusFitness:
    """Measures chromosomes of one image size and joins them; a cell costs at most `dearest`."""

    def __init__(self, possibility, verdict, target):
        """Bind to the possibility, and to the pixels' verdict and the target's labels."""
        rows, columns = verdict.shape
        self._bands = cut_bands(rows)
        self.dearest = possibility.model.largest
        penalties = possibility.penalties
        self._possibility = possibility     # whose features are addresses
        self._scene = gene_cost.Scene(verdict, target, (0, columns - 1), HIDDEN, CONTRADICTED)
        self.penalties = penalties._replace(
            small=penalties.small // SMOOTHNESS, across=np.zeros_like(penalties.across),
            down=np.zeros_like(penalties.down))
        self._costs, self._other_costs = (np.zeros((rows, columns), np.uint8) for _ in range(2))
        self._regions = np.zeros((rows, columns), np.int32)
        self._cells = np.zeros(rows * columns + 1, np.int32)
        self._parent, self._change, self._size = (
            np.zeros(rows * columns // 2 + 2, np.int32) for _ in range(3))
        self._histogram = np.zeros(256, np.int64)
        self._known = False         # whether the costs are those of all of the mother's genes

    def look(self, crew, inside):
        """Take in a new frame. inside: first and last column of the target that exist."""
        self._scene = self._scene._replace(inside=inside)
        scaled, full = self.penalties, self._possibility.penalties

        def scale(band):
            rows = slice(band[1], band[2])
            np.floor_divide(full.across[rows], SMOOTHNESS, out=scaled.across[rows])
            np.floor_divide(full.down[rows], SMOOTHNESS, out=scaled.down[rows])
        crew.each(scale, self._bands)

    def adopt(self, crew, chromosome, every=SAMPLE_STEP):
        """
        Take a chromosome as the mother of what follows.

        Returns its fitness, measured on each row whose number `every` divides: 1 where everything
        is fully possible and smooth, lower elsewhere. What is gained later is measured everywhere.
        """
        self._known = False
        totals = np.zeros((len(self._bands), 2), np.int64)

        def measure(band):
            gene_cost.gene_costs(
                *self._seen(), chromosome, self._costs, every, band[1], band[2])
            totals[band[0]] = gene_cost.row_costs(
                *self.penalties, chromosome, self._costs, every, band[1], band[2])
        crew.each(measure, self._bands)
        total, number = totals.sum(axis=0)
        return 1 - int(total) / (self.dearest * int(number))

    def join(self, crew, mother, father):
        """
        Give the adopted mother the father's fitter regions.

        Returns the fitness that she gained, and the father's fitness above hers before.
        """
        cells = self._cells[:differing_cells(mother, father, self._cells)]
        share = -(-cells.size // len(self._bands))

        def price(band):
            mine = cells[share * band[0]:share * (band[0] + 1)]
            if not self._known:
                gene_cost.cell_costs(*self._seen(), mother, mine, self._costs)
            gene_cost.cell_costs(*self._seen(), father, mine, self._other_costs)
        crew.each(price, self._bands)
        saved, dearer = partition_crossover(
            *self.penalties, mother, self._costs, father, self._other_costs, cells,
            ADVANTAGE, self._regions, self._parent, self._change, self._size)
        largest = self.dearest * mother.size
        return saved / largest, -dearer / largest

    def costs_of(self, crew, chromosome):
        """Return what each gene costs without its jumps: uint8 (R, C), overwritten next time."""
        self._known = False
        crew.each(lambda band: gene_cost.gene_costs(
            *self._seen(), chromosome, self._costs, 1, band[1], band[2]), self._bands)
        return self._costs

    def possibility_of(self, crew, chromosome):
        """
        Return how possible each gene is, hidden ones as the fitness counts them.

        chromosome: (R, C) labels; possibility: float32 (R, C), 0 to 1. Changes nothing here.
        """
        costs = np.empty_like(self._costs)
        crew.each(lambda band: gene_cost.gene_costs(
            *self._seen(), chromosome, costs, 1, band[1], band[2]), self._bands)
        return 1 - costs / np.float32(self.dearest)

    def aim(self, crew, mother, rate):
        """
        Learn what a mother's genes cost, and which are the `rate` least possible ones.

        Joining keeps the costs up to date, until another chromosome is adopted.
        """
        aimed_mutation.count_costs(self.costs_of(crew, mother), self._histogram, SAMPLE_STEP)
        share = np.cumsum(self._histogram[::-1])[::-1] / self._histogram.sum()
        self._dear, self._known = max(int(np.argmax(share <= rate)), 1), True

    def mutate(self, mother, child, radius, reach, patches, key):
        """Paint patches on the least possible cells of a copy of the mother: those aimed at."""
        aimed_mutation.mutate_patches(mother, self._costs, child, self._dear, radius, reach,
                                      patches, key)

    def _seen(self):
        """Return what genes are measured against, as kernels take it."""
        return tuple(self._possibility.features), tuple(self._scene)
