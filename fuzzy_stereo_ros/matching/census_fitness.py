# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The fitness of the profile `realtime`: possibility, smoothness and occlusion in one number.

Not in the paper: Eq. 3 prefers wrong maps, since it pays to point at strong edges. Here a
chromosome loses what its genes cost: matches that are little possible, jumps of disparity (less
at grey edges), and labels that contradict what the target image shows.
"""
from fuzzy_stereo_ros.matching.bands import cut_bands
from fuzzy_stereo_ros.matching.kernels import aimed_mutation, gene_cost
from fuzzy_stereo_ros.matching.kernels.partition import partition_crossover
from fuzzy_stereo_ros.matching.scanline_guess import gene_type
import numpy as np

SMOOTHNESS = 4       # the passes' penalties are divided by this: they count four paths
HIDDEN = 6           # cost of a gene that something nearer hides
CONTRADICTED = 15    # cost of a gene that would hide what can be seen
SAMPLE_STEP = 4      # every so many rows, and columns, are looked at where a sample will do


class CensusFitness:
    """Measures chromosomes of one image size and joins them."""

    def __init__(self, possibility, verdict, target):
        """Bind to the possibility, and to the pixels' verdict and the target's labels."""
        rows, columns = verdict.shape
        self._bands = cut_bands(rows)
        self._dearest = possibility.model.largest
        penalties = possibility.penalties
        self._scene = gene_cost.Scene(
            possibility.features, penalties._replace(
                small=penalties.small // SMOOTHNESS, across=np.zeros_like(penalties.across),
                down=np.zeros_like(penalties.down)),
            verdict, target, 0, HIDDEN, CONTRADICTED)
        self._penalties = penalties
        self._costs, self._other_costs = (np.zeros((rows, columns), np.uint8) for _ in range(2))
        self._everything = np.zeros((0, 0), gene_type(possibility.disparities))
        self._regions = np.zeros((rows, columns), np.int32)
        self._parent, self._change = (
            np.zeros(rows * columns // 2 + 2, np.int32) for _ in range(2))
        self._histogram = np.zeros(256, np.int64)

    @property
    def penalties(self):
        """What changes of disparity cost."""
        return self._scene.penalties

    def look(self, crew, first_inside):
        """Take in a new frame. first_inside: first column of the target that exists."""
        self._scene = self._scene._replace(first_inside=first_inside)
        scaled, full = self._scene.penalties, self._penalties

        def scale(band):
            rows = slice(band[1], band[2])
            np.floor_divide(full.across[rows], SMOOTHNESS, out=scaled.across[rows])
            np.floor_divide(full.down[rows], SMOOTHNESS, out=scaled.down[rows])
        crew.each(scale, self._bands)

    def adopt(self, crew, chromosome):
        """
        Take a chromosome as the mother of what follows.

        Returns its fitness, measured on a sample of the rows: 1 where everything is fully
        possible and smooth, lower elsewhere. What is gained later is measured everywhere.
        """
        totals = np.zeros((len(self._bands), 2), np.int64)

        def measure(band):
            self._price(chromosome, self._everything, self._costs, SAMPLE_STEP, band)
            totals[band[0]] = gene_cost.row_costs(
                self._scene.penalties, chromosome, self._costs, SAMPLE_STEP, band[1], band[2])
        crew.each(measure, self._bands)
        total, number = totals.sum(axis=0)
        return 1 - int(total) / (self._dearest * int(number))

    def join(self, crew, mother, father):
        """
        Give the adopted mother the father's fitter regions.

        Returns the fitness that she gained, and the father's fitness above hers before.
        """
        def price(band):
            self._price(mother, father, self._costs, 1, band)
            self._price(father, mother, self._other_costs, 1, band)
        crew.each(price, self._bands)
        saved, dearer = partition_crossover(
            self._scene.penalties, mother, self._costs, father, self._other_costs,
            self._regions, self._parent, self._change)
        largest = self._dearest * mother.size
        return saved / largest, -dearer / largest

    def _price(self, chromosome, other, costs, every, band):
        """Fill the costs of the genes of a band that differ from another chromosome's."""
        gene_cost.gene_costs(self._scene, chromosome, other, costs, every, band[1], band[2])

    def mutate(self, crew, mother, child, rate, radius, reach, patches, key):
        """Paint patches on the `rate` least possible cells of a copy of the mother."""
        crew.each(lambda band: self._price(mother, self._everything, self._costs, 1, band),
                  self._bands)
        aimed_mutation.count_costs(self._costs, self._histogram, SAMPLE_STEP)
        share = np.cumsum(self._histogram[::-1])[::-1] / self._histogram.sum()
        dear = max(int(np.argmax(share <= rate)), 1)
        aimed_mutation.mutate_patches(mother, self._costs, child, dear, radius, reach, patches,
                                      key)
