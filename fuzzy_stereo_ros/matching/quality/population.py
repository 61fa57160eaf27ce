# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The population of the profile `quality`: plane maps of both views of a pair.

A chromosome is a plane map of the left view and one of the mirrored right view. The first is the
fittest: it takes what is fitter from the others. Where the maps of its two views disagree, matches
count little in the fitness of all.
"""
from fuzzy_stereo_ros.matching.crossover import Exchange
from fuzzy_stereo_ros.matching.kernels.planes.costs import select_differing, take_planes
from fuzzy_stereo_ros.matching.quality.result import consistent
import numpy as np


class Member:
    """A plane map of a view, float32 (R, C, 3), and the costs of its matches: int16 (R, C)."""

    def __init__(self, planes, match_costs, costs):
        """match_costs: without trust; costs: with it."""
        self.planes, self.match_costs, self.costs = planes, match_costs, costs


class Tools:
    """The crossover and its memory, allocated when operators first use it."""

    def __init__(self, shape, crossover, evidence):
        """shape: (R, C); crossover, evidence: see the `Stages` of the matcher."""
        self._shape, self._crossover, self._evidence = shape, crossover, evidence
        self._memory = None

    def release(self):
        """Free the memory."""
        self._memory = None

    def __iter__(self):
        """Yield the crossover, its `Exchange` and the evidence."""
        if self._memory is None:
            self._memory = (self._crossover(*self._shape, 4), Exchange(*self._shape, 4),
                            self._evidence(*self._shape))
        return iter(self._memory)


class View:
    """
    One view of a pair: its fitness, its segments, and the maps of all chromosomes.

    members: list of `Member`; segments: see segments_of; colour: uint8 (R, C, 3)
    """

    def __init__(self, pool, fitness, colour, segments, tools):
        """tools: the `Tools` of both views."""
        self.pool, self.fitness, self.colour, self.segments = pool, fitness, colour, segments
        self._tools, self.members = tools, []

    def measured(self, planes):
        """Return a plane map as a `Member`."""
        match_costs = self.fitness.match_costs(self.pool, planes)
        return Member(planes, match_costs, self.fitness.trusted_costs(self.pool, match_costs))

    def total(self, member):
        """Return the cost of a member with smoothness."""
        return self.fitness.total(self.pool, member.planes, member.costs)

    def disparities(self, member):
        """Return the disparities of a member: float32 (R, C), px from 0."""
        return self.fitness.disparities(self.pool, member.planes)

    def propose(self, member, planes, regions, random):
        """
        Give a member the planes of a proposal where that makes it fitter.

        planes: float32 (R, C, 3); regions: the `Regions` whose planes they are; a region that the
        images are evidence against keeps its planes
        """
        selected = np.empty(member.costs.shape, np.bool_)
        select_differing(member.planes, planes, selected)
        match_costs = self.fitness.match_costs(self.pool, planes, selected)
        _, _, evidence = self._tools
        evidence.reject(
            regions.labels, self.disparities(member),
            self.fitness.disparities(self.pool, planes), member.match_costs, match_costs,
            self.fitness.trusted(), selected)
        self._cross(member, planes, match_costs, selected, random)

    def cross(self, member, other, random):
        """Give a member the planes of another one where that makes it fitter."""
        selected = np.empty(member.costs.shape, np.bool_)
        select_differing(member.planes, other.planes, selected)
        self._cross(member, other.planes, other.match_costs, selected, random)

    def trust_consistent(self, consistent):
        """Trust matches where the views agree, bool (R, C), and measure all members anew."""
        self.fitness.trust_consistent(consistent)
        for member in self.members:
            member.costs = self.fitness.trusted_costs(self.pool, member.match_costs)

    def _cross(self, member, planes, match_costs, selected, random):
        costs = self.fitness.trusted_costs(self.pool, match_costs)
        crossover, exchange, _ = self._tools
        self.fitness.fill(exchange, (member.planes, member.costs), (planes, costs), selected)
        crossover(exchange, random)
        taken = exchange.cells[exchange.taken]
        member.match_costs.reshape(-1)[taken] = match_costs.reshape(-1)[taken]
        take_planes(member.planes, member.costs, planes, costs, exchange.cells, exchange.taken)


class Population:
    """
    Chromosomes of both views, of which each generation evolves one.

    views: the `View`s of the left and of the mirrored right image; tools: their `Tools`
    fitness: float64 (P,), of the left maps, 1 where nothing costs; best: index of the fittest,
    after a generation the first; converged: never, the budget ends it
    """

    converged = False

    def __init__(self, views, tools, lowest, trusted=consistent):
        """lowest: px, the disparity that planes count from; trusted: see result.consistent."""
        self.views, self.tools, self._lowest, self._trusted = views, tools, lowest, trusted
        self.current, self.fitness = 0, np.zeros(1)

    def initialise(self, maps):
        """
        Set the first plane maps.

        maps: of each view a list of plane maps, the same number
        """
        for view, found in zip(self.views, maps):
            view.members = [view.measured(planes) for planes in found]
        self.current = 0
        self.fitness = np.zeros(len(maps[0]))
        self.measure_all()

    @property
    def genes(self):
        """The left maps as disparities from 0 in whole px, the fittest first: int16 (P, R, C)."""
        left = self.views[0]
        return np.stack([np.rint(left.disparities(member)).astype(np.int16)
                         for member in left.members])

    @property
    def best(self):
        """Index of the fittest chromosome."""
        return int(self.fitness.argmax())

    def make_first(self, place):
        """Swap the first chromosome and that at a place."""
        for view in self.views:
            view.members[0], view.members[place] = view.members[place], view.members[0]
        self.fitness[[0, place]] = self.fitness[[place, 0]]

    def measure(self, place):
        """Measure the fitness of the chromosome at a place."""
        left = self.views[0]
        self.fitness[place] = 1 - left.total(left.members[place]) / left.fitness.largest

    def measure_all(self):
        """Measure the fitness of all chromosomes."""
        for place in range(len(self.fitness)):
            self.measure(place)

    def update_trust(self, maps):
        """Trust the matches of both views where their maps agree: float32 (R, C), px."""
        for view, one, other in zip(self.views, maps, reversed(maps)):
            view.trust_consistent(self._trusted(view.pool, one, other, self._lowest))
