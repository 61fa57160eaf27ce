# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Searches that write down what they have after each generation, from several populations."""
from dataclasses import dataclass, field
import time

from fuzzy_stereo_ros.benchmarks.measured_search import MeasuredSearch
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.matching.evolution import always
from fuzzy_stereo_ros.matching.kernels.genetic.random_numbers import key_of
from fuzzy_stereo_ros.matching.paper_search import PaperSearch
from fuzzy_stereo_ros.matching.seeds import random_chromosome
import numpy as np

ALLELES = 8         # random genes of which a guess from the data takes the most possible one
SEEDS = -1          # the word of chance that sets seeds apart from generations
UNTIL_TIME_IS_UP = 1_000_000    # generations


class NotedSearch(MeasuredSearch):
    """
    The guided search, noting its fittest chromosome; it may run many generations.

    notes: (ns by `time.perf_counter_ns`, chromosome) of the seeds and of each generation.
    """

    scaffolding = ()        # stages that the seeds do not need: their time does not count

    def start(self, left, right, state, seed_words):
        """Make the initial population of a pair."""
        self.notes = []
        super().start(left, right, state, seed_words)
        self._note()

    def generation(self, number, in_time=always):
        """Make the next generation, note the fittest, return the gains."""
        gains = super().generation(number, in_time)
        self._note()
        return gains

    def _note(self):
        self.notes.append((time.perf_counter_ns(), self._members[0].copy()))


class RandomSeeds(NotedSearch):
    """The same search from the paper's initial population: independent, uniform genes."""

    scaffolding = 'coarse', 'scanlines'

    def generation(self, number, in_time=always):
        """Cross the fittest with all others first; go on as the guided search does."""
        if number > 1:
            return super().generation(number, in_time)
        gained = sum(self._cross(father) for father in range(1, len(self.fitness)) if in_time())
        self._note()
        return {'crossover': gained}

    def _seed(self):
        for slot, member in enumerate(self._members):
            member[:] = self._seed_of(slot)
        fitness = np.array([self.fitness_of(member) for member in self._members])
        order = np.argsort(-fitness, kind='stable')
        self._members[:], self.fitness = self._members[order], fitness[order]
        self.warm = False

    def _seed_of(self, slot):
        return self._random(slot, 0)

    def _random(self, slot, allele):
        genes = np.zeros(self._shape, np.uint16)
        random_chromosome(key_of(*self._seed_words, SEEDS, slot, allele),
                          self._config.disparities, genes)
        return genes.astype(self._members.dtype)


class DataSeeds(RandomSeeds):
    """The same search from guesses: each gene the most possible of a few random ones."""

    def _seed_of(self, slot):
        best = self._random(slot, 0)
        least = self._fitness.costs_of(self._crew, best).copy()
        for allele in range(1, ALLELES):
            rival = self._random(slot, allele)
            costs = self._fitness.costs_of(self._crew, rival)
            better = costs < least
            best[better], least[better] = rival[better], costs[better]
        return best


@dataclass(frozen=True)
class Start:
    """
    Where a population comes from.

    profile, changes: of the matcher; warm: whether it has seen the frames before.
    """

    name: str
    search: type
    changes: dict = field(default_factory=dict)
    profile: str = 'realtime'
    warm: bool = False


POPULATION = {'population': 10}
# Aiming at the least possible share misses all where more than that are equally impossible.
FROM_CHANCE = {**POPULATION, 'mutation_rate': 1.0}
STARTS = (
    Start("random, the paper's operators and fitness", PaperSearch, {
        'population': 50, 'reference': 'left'}, 'paper'),
    Start('random, our operators and fitness', RandomSeeds, FROM_CHANCE),
    Start('guesses from the data', DataSeeds, FROM_CHANCE),
    Start('guesses from the data, sweeps', DataSeeds, {**FROM_CHANCE, 'sweeps': 1}),
    Start('scanline seeds', NotedSearch, POPULATION),
    Start('scanline seeds, sweeps', NotedSearch, {**POPULATION, 'sweeps': 1}),
    Start('previous frame', NotedSearch, POPULATION, warm=True),
    Start('previous frame, sweeps', NotedSearch, {**POPULATION, 'sweeps': 1}, warm=True),
)


def course_of(start, disparities, frames, milliseconds):
    """
    Return [(milliseconds, chromosome)] of a run on the last of some frames until time is up.

    frames: (left, right) of each; those before the last are only seen where the start is warm.
    """
    matcher = StereoMatcher(MatcherConfig.from_profile(
        start.profile, disparities=disparities, threads=1, warm_start=start.warm,
        generations=UNTIL_TIME_IS_UP, deadline_ms=float(milliseconds), **start.changes),
        start.search)
    matcher.warm_up(*frames[-1][0].shape[:2])
    for left, right in frames[:-1] if start.warm else ():
        matcher.match(left, right)
    notes = []

    def observe(_, population):
        notes.append((time.perf_counter_ns(), population[matcher.search.best].copy()))

    begun = time.perf_counter_ns()
    match = matcher.match(*frames[-1], observe=observe if start.search is PaperSearch else None)
    search = matcher.search
    free = sum(match.times[stage] for stage in getattr(search, 'scaffolding', ()))
    return [((noted - begun) / 1e6 - free, genes)
            for noted, genes in getattr(search, 'notes', notes)]
