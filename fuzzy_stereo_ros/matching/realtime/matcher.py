# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The profile `realtime`: `RealtimeMatcher.match` is one frame, a line a stage.

A frame is a generation: its map is selected among the genes of its parents, the half-size
chromosome of this pair and the previous best; inconsistent cells are filled from the background.
Mutation proposes planes to regions of weak texture, and crossover takes what is fitter. The map
that was selected is a parent of the next frame.
"""
from collections.abc import Callable
from functools import partial
from typing import NamedTuple

from fuzzy_stereo_ros.matching.bands import Chain, ThreadPool
from fuzzy_stereo_ros.matching.crossover import PartitionCrossover
from fuzzy_stereo_ros.matching.evidence import Evidence
from fuzzy_stereo_ros.matching.evolution import Durations, evolve, Random, Stopwatch
from fuzzy_stereo_ros.matching.match import Match
from fuzzy_stereo_ros.matching.realtime.fitness import CensusFitness
from fuzzy_stereo_ros.matching.realtime.generation import InheritedGenes, Squares
from fuzzy_stereo_ros.matching.realtime.half_size import HalfSize
from fuzzy_stereo_ros.matching.realtime.operators import NotMutated, Population, WeakRegions
from fuzzy_stereo_ros.matching.realtime.plain_regions import PlainRegions
from fuzzy_stereo_ros.matching.realtime.refinement import Refinement
from fuzzy_stereo_ros.matching.realtime.views import Views
from fuzzy_stereo_ros.matching.realtime.warm_start import RealtimeState, WarmStart

REFINING = 'all after the generations'      # for Durations
ADVANTAGE = 1       # cost a cell by which a region must be cheaper to be taken
FEWEST_SHARED = 100_000     # pixels; of fewer, threads wait longer than they save


class Stages(NamedTuple):
    """
    The stages that can be exchanged, as the ablation does (bench/variants.py).

    generation: called with the `CensusPossibility` of full images and `Squares`, returns what
    selects the chromosome at full size, see InheritedGenes
    previous_best: called as `WarmStart.previous_best`, returns the previous best as a parent, and
    as a prior
    vote: called with the `Views` and the smallest disparity, returns the mutation of plain regions
    by the evidence of all of their pixels, see PlainRegions
    mutation: called with the `CensusPossibility` of full images and a dtype of labels, returns
    the mutation by planes of weak regions, see WeakRegions
    """

    generation: Callable = InheritedGenes
    previous_best: Callable = WarmStart.previous_best
    vote: Callable = PlainRegions
    mutation: Callable = WeakRegions


# by MatcherConfig.planes
STAGES = {True: Stages(), False: Stages(
    generation=partial(InheritedGenes, few=True), vote=NotMutated, mutation=NotMutated)}


class RealtimeMatcher:
    """
    The stages of one image size.

    population: the `Population` of the last pair; state_type: of what it adds to a `FrameState`
    """

    state_type = RealtimeState

    def __init__(self, config, rows, columns, stages=None):
        """Allocate all that pairs of one size need."""
        self._config, self._stages = config, stages or STAGES[config.planes]
        self.pool = ThreadPool(config.threads if rows * columns >= FEWEST_SHARED else 1)
        self._views = Views(config, rows, columns)
        full = self._views.full
        self._plain_regions = self._stages.vote(self._views, config.min_disparity)
        squares = Squares()
        self._generation = self._stages.generation(full, squares)
        self._half_size = HalfSize(self._views.small, squares, rows, columns, config.disparities)
        self._warm_start = WarmStart(rows, columns, config.disparities, config.min_disparity)
        labels_type = self._generation.chosen.labels.dtype
        self._refinement = Refinement(full, labels_type, config.planes)
        self._evidence = Evidence(
            self._views.half.left, self._views.half.right, self._views.noises)
        self._fitness = CensusFitness(
            full, self._refinement.validity, self._generation.chosen.target)
        self.population = Population(
            self.pool, self._fitness, PartitionCrossover(rows, columns, ADVANTAGE),
            self._generation.chosen.labels)
        self._weak_regions = self._stages.mutation(full, labels_type)
        self._durations, self._watch = Durations(), Stopwatch()
        self._searching, self._selecting = self._search_half_size(), self._select_at_full_size()

    def match(self, left, right, previous, random, budget, observe=None, camera=None):
        """
        Match a pair; return the `Match`, and the `FrameState` for the next one.

        left, right: uint8 or uint16 (R, C) or (R, C, 3); previous: the previous frame's
        FrameState or None; random, budget, observe: as `evolve` takes them; camera: a `Camera`
        that may have moved, or None
        """
        config, warm, watch = self._config, self._warm_start, self._watch
        watch.begin()
        self._read(left, right, previous, camera)
        state = warm.reused_state(previous, config)
        if state is not None:
            return Match(state.own.still_disparity.copy(), state.own.still_confidence.copy(), [],
                         watch.times, True, warm.motion, reused=True), state
        self._views.smooth(self.pool)
        self._searching.run()
        warm_start = self._inherit(previous)
        self._selecting.run()
        watch.lap('selection')
        budget = budget.reserving(self._durations[REFINING])
        history = evolve(self.population, self._weak_regions.operators, random, budget, observe,
                         self._durations)
        best = self.population.genes[self.population.best]
        watch.lap('generations')
        before = sum(watch.times.values())
        disparity, confidence = self._refine(best)
        match = Match(disparity, confidence, history, watch.times, warm_start, warm.motion)
        if config.warm_start:
            state = warm.next_state(
                self.pool, self._views, self._refinement, config, match, previous)
            watch.lap('handing_on')
        self._durations.record(REFINING, sum(watch.times.values()) - before)
        return match, state

    def _read(self, left, right, previous, camera):
        """Read a pair, and average it with the previous frame's, see `match`."""
        views, warm, pool, watch = self._views, self._warm_start, self.pool, self._watch
        chain = Chain(pool)
        views.read(chain, left, right, previous)
        if previous is None and self._config.warm_start:
            warm.average(chain, None, views)
        chain.run()
        if camera is not None:      # followed by what is not averaged yet
            views.full.left.halve(views.half.left, 0, views.half.rows)
        if previous is not None:
            warm.average(pool, previous, views)
        watch.lap('pictures')
        if self._config.warm_start:
            warm.follow(pool, previous, camera, views)
        if previous is not None:
            views.noise *= warm.noise_left
        if warm.motion:
            watch.lap('camera_motion')

    def _search_half_size(self):
        """
        Return the Chain that describes a pair and searches it at half size.

        Plain regions get the planes that they vote for, and weak regions are grown.
        """
        views, chain = self._views, Chain(self.pool)
        described = views.describe(chain)
        chain.each(self._watch.lap, ['possibility'])
        self._plain_regions.find(chain)
        searched = self._half_size.search(chain, after=described)
        completed = self._half_size.complete(chain, views, after=searched)
        self._plain_regions.mutate(chain, self._half_size.result)
        self._weak_regions.grow(chain, views.half.left.luminance, self._half_size.weak, completed)
        return chain

    def _inherit(self, previous):
        """Inherit from the previous frame's FrameState or None; return whether that is used."""
        generation, result = self._generation, self._half_size.result
        generation.previous, generation.prior = self._stages.previous_best(
            self._warm_start, self.pool, previous, result)
        self._watch.lap('coarse')
        return generation.previous is not None or generation.prior is not None

    def _select_at_full_size(self):
        """
        Return the Chain that selects among the genes of a pair at full size.

        It fills the population with them, and makes the mutant.
        """
        chain, chosen, population = Chain(self.pool), self._generation.chosen, self.population
        config, refinement, validity = self._config, self._refinement, self._refinement.validity
        selected = self._generation.select(chain, self._half_size.result)
        checked = refinement.check(chain, chosen, config, after=selected)
        filled = population.fill(chain, chosen.labels, validity)
        self._weak_regions.mutate(chain, chosen, validity, population.genes[0],
                                  Random((config.seed,)), after=checked)
        population.measure(chain, after=filled)
        return chain

    def _refine(self, best):
        """Return the disparity and the confidence of (R, C) labels, as `Refinement.write`."""
        chain, refinement, warm = Chain(self.pool), self._refinement, self._warm_start
        evidence, chosen, half = self._evidence, self._generation.chosen, self._half_size.result
        bands = self.pool.parts(len(best))
        chain.each(lambda band: evidence.sum_up(best, band), bands)
        chain.each(lambda _: evidence.judge(), [0])
        labels = refinement.smooth(chain, chosen.labels, best, self._views.full.left.grey)
        result = refinement.write(
            chain, labels, chosen, half,
            lambda *rows: evidence.reject(refinement.final_validity, half.prior.weights, *rows),
            self._config)
        if self._config.warm_start:
            # as found: what smoothing wears away would not come back
            warm.keep(chain, chosen.labels, refinement.final_validity)
        chain.run()
        self._watch.lap('refinement')
        return result

    def possibility_of(self, chromosome):
        """Return the possibility of a chromosome's matches: float32 (R, C), 0 to 1."""
        return self._fitness.possibility_of(self.pool, chromosome)

    def origin_of_genes(self):
        """Return which parent the genes selected in the last pair are from: uint8 (R, C)."""
        return self._generation.origin_of_genes()

    @property
    def noise(self):
        """The noise that averaging left in the last pair: grey levels, standard deviation."""
        return self._views.noise
