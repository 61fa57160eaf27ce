# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The population of the profile `quality`: a plane map of each view of a pair.

The chromosome is a plane map of the left view and one of the mirrored right view. It takes what is
fitter from mutants. Where the maps of its two views disagree, matches count little in the fitness.
"""
from fuzzy_stereo_ros.matching.kernels.units import INVALID
from fuzzy_stereo_ros.matching.quality.result import compare
import numpy as np


class EvolvingView:
    """
    One view of a pair: its fitness, its segments, and its plane map.

    segments: see segments_of; planes: float32 (R, 3, C), the map; match_costs: int16 (R, C), of
    its matches, without trust
    """

    def __init__(self, pool, fitness, segments, tools, planes):
        """tools: of both views: a crossover, its `Exchange`, evidence, see the `Stages`."""
        self.pool, self.fitness, self.segments = pool, fitness, segments
        self._tools, self.planes = tools, planes
        self.match_costs = fitness.match_costs(pool, planes)

    def measured(self):
        """Return the fitness of the map: 1 where nothing costs."""
        return 1 - self.fitness.total(self.pool, self.planes, self._costs) / self.fitness.largest

    @property
    def disparities(self):
        """The disparities of the map: float32 (R, C), px from 0."""
        return self.fitness.disparities(self.pool, self.planes)

    def propose(self, planes, regions, random):
        """Take proposed planes, float32 (R, 3, C), of regions where fitter and founded."""
        pool, fitness = self.pool, self.fitness
        selected = (self.planes != planes).any(axis=1)
        match_costs = fitness.match_costs(pool, planes, selected)
        crossover, exchange, evidence = self._tools
        evidence(
            regions.labels, (self.disparities, self.match_costs),
            (fitness.disparities(pool, planes), match_costs), fitness.trusted, selected)
        costs = fitness.trusted_costs(match_costs)
        fitness.fill(exchange, (self.planes, self._costs), (planes, costs), selected)
        crossover(exchange, random)
        exchange.take(self.match_costs, match_costs)
        exchange.take(self._costs, costs)
        row, column = np.divmod(exchange.cells[exchange.taken], costs.shape[1])
        self.planes[row, :, column] = planes[row, :, column]

    def trust_consistent(self, consistent):
        """Trust matches where the views agree, bool (R, C), and measure the map anew."""
        self.fitness.trusted[:] = consistent
        self._costs = self.fitness.trusted_costs(self.match_costs)


class Population:
    """
    One chromosome of both views.

    views: the `EvolvingView`s of the left and of the mirrored right image; fitness: float64 (1,),
    of the left map; best: 0; converged: never, the budget ends it
    """

    best, converged = 0, False

    def __init__(self, views, lowest):
        """lowest: px, the disparity that planes count from."""
        self.views, self._lowest, self.fitness = views, lowest, np.zeros(1)

    @property
    def genes(self):
        """The left map as disparities from 0 in whole px: int16 (1, R, C)."""
        return np.rint(self.views[0].disparities).astype(np.int16)[np.newaxis]

    def measure(self):
        """Measure the fitness."""
        self.fitness[0] = self.views[0].measured()

    def update_trust(self, maps):
        """Trust matches of both views where their maps, float32 (R, C), px, agree; measure."""
        for view, one, other in zip(self.views, maps, reversed(maps)):
            view.trust_consistent(compare(view.pool, one, other, self._lowest) != INVALID)
        self.measure()
