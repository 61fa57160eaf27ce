# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The profile `realtime`: `RealtimeMatcher.match` is one frame, a line a stage.

The half-size chromosome limits the search; the scanline chromosome is the best that the data of
this pair give; its inconsistent cells are filled from the background. Mutation proposes planes to
regions of weak texture, and crossover takes what is fitter. The chromosome of planes that is
inherited from the previous frame evolves further and is written into the first.
"""
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import NamedTuple

from fuzzy_stereo_ros.matching.arrays import Lent
from fuzzy_stereo_ros.matching.bands import Chain, ThreadPool
from fuzzy_stereo_ros.matching.crossover import Regions
from fuzzy_stereo_ros.matching.evolution import Durations, evolve, Random, Stopwatch
from fuzzy_stereo_ros.matching.match import Match
from fuzzy_stereo_ros.matching.over_frames.pictures import NoiseEstimate
from fuzzy_stereo_ros.matching.realtime.fitness import CensusFitness
from fuzzy_stereo_ros.matching.realtime.frames import FrameEvolution, NothingInherited
from fuzzy_stereo_ros.matching.realtime.half_size import HalfSize, TILE
from fuzzy_stereo_ros.matching.realtime.operators import Population, WeakRegions
from fuzzy_stereo_ros.matching.realtime.plain_regions import PlainRegions
from fuzzy_stereo_ros.matching.realtime.possibility import CensusPicture
from fuzzy_stereo_ros.matching.realtime.propagation import Propagation
from fuzzy_stereo_ros.matching.realtime.refinement import Refinement
from fuzzy_stereo_ros.matching.realtime.scanlines import Scanlines
from fuzzy_stereo_ros.matching.realtime.views import Views
from fuzzy_stereo_ros.matching.realtime.warm_start import RealtimeState, WarmStart

PLANES = 1          # child of the frame's random source for the evolution of planes
REFINING = 'all after the generations'      # for Durations
ADVANTAGE = 1       # cost a cell by which a region must be cheaper to be taken


class Stages(NamedTuple):
    """
    The stages that can be exchanged, as the ablation does (bench/variants.py).

    search: called with the `CensusPossibility` of full images and TILE, returns what searches
    the chromosome at full size, see Scanlines
    noise: called with rows and columns, returns a noise estimate, see NoiseEstimate
    describe: called with a `CensusPicture` and a range of rows, writes the features of its pixels
    previous_best: called as `WarmStart.prior_of_previous`, returns the prior of the previous best
    crossover: called with rows and columns, returns a crossover, see matching/crossover.py
    vote: called with the `Views` and the smallest disparity, returns the mutation of plain regions
    by the evidence of all of their pixels, see PlainRegions; None for none
    mutation: called with rows, columns and a dtype of labels, returns a mutation, see WeakRegions;
    None for none
    frames: called with a `CensusPossibility`, rows and columns, returns the population of planes
    that frames inherit, see FrameEvolution
    """

    search: Callable = Scanlines
    noise: Callable = NoiseEstimate
    describe: Callable = CensusPicture.describe
    previous_best: Callable = WarmStart.prior_of_previous
    crossover: Callable = partial(Regions, advantage=ADVANTAGE)
    vote: Callable | None = PlainRegions
    mutation: Callable | None = WeakRegions
    frames: Callable = FrameEvolution


# by MatcherConfig.search
STAGES = {
    'scanlines': Stages(),
    'propagation': Stages(search=Propagation, previous_best=WarmStart.no_prior, vote=None,
                          mutation=None, frames=NothingInherited)}


class RealtimeMatcher:
    """
    The stages of one image size.

    population: the `Population` of the last pair; frames: the `FrameEvolution`; state_type: of
    what it adds to a `FrameState`
    """

    state_type = RealtimeState

    def __init__(self, config, rows, columns, stages=None):
        """Allocate all that pairs of one size need."""
        self._config, self._stages = config, stages or STAGES[config.search]
        self.pool = ThreadPool(config.threads)
        self._views = Views(config, rows, columns, self._stages.noise)
        if self._stages.vote is not None:
            self._plain = self._stages.vote(self._views, config.min_disparity)
        self._search = self._stages.search(self._views.full, TILE)
        memory = self._search.memory    # for the half-size search before, and for what comes after
        self._half_size = HalfSize(
            self._views.half, rows, columns, config.disparities, Lent(memory))
        self._warm_start = WarmStart(rows, columns, config.disparities, config.min_disparity)
        labels_type = self._search.chosen.labels.dtype
        self._refinement = Refinement(
            rows, columns, config.disparities, labels_type, self._search.by_membership,
            Lent(memory))
        self._fitness = CensusFitness(
            self._views.full, self._refinement.validity, self._search.chosen.target,
            Lent(memory))
        self.population = Population(self._fitness, self._search.chosen.labels)
        self._crossover = self._stages.crossover(rows, columns)
        self.frames = self._stages.frames(self._views.full, rows, columns)
        self._durations = Durations()
        if self._stages.mutation is not None:
            self._regions = self._stages.mutation(rows, columns, labels_type)

    def match(self, left, right, previous, random, budget, observe=None, camera=None):
        """
        Match a pair; return the `Match`, and the `FrameState` for the next one.

        left, right: uint8 or uint16 (R, C) or (R, C, 3); previous: the previous frame's
        FrameState or None; random, budget, observe: as `evolve` takes them; camera: a `Camera`
        that may have moved, or None
        """
        config, pool, views, warm = self._config, self.pool, self._views, self._warm_start
        watch = Stopwatch()
        chain = Chain(pool)
        views.read(chain, left, right)
        if previous is None and config.warm_start:
            warm.average(chain, None, views)
        views.estimate(chain)
        chain.run()
        if previous is not None:
            warm.average(pool, previous, views)
        watch.lap('pictures')
        if config.warm_start:
            warm.follow(pool, previous, camera, views)
        if previous is not None:
            views.noise *= warm.noise_left
        if warm.motion:
            watch.lap('camera_motion')
        state = warm.reused_state(previous, config)
        if state is not None:
            return Match(state.own.still_disparity.copy(), state.own.still_confidence.copy(), [],
                         watch.times, True, warm.motion, reused=True), state
        views.smooth(pool)
        chain = Chain(pool)
        views.describe(chain, self._stages.describe)
        described = chain.stages_so_far()
        chain.each(watch.lap, ['possibility'])
        if self._stages.vote is not None:
            self._plain.find(chain)
        half = self._half_size.search(
            chain, views.target_range, views.full.left.grey, views.noise, described)
        chain.run()
        if self._stages.mutation is not None:
            self._regions.grow(chain, views.half.left.luminance, self._half_size.weak)
        if self._stages.vote is not None:
            self._half_size.mutate(chain, self._plain, views.target_range)
        if previous is not None:
            chain.run()     # the previous best is compared with the half-size map
        previous_prior = self._stages.previous_best(warm, pool, previous, half)
        self._search.limit(chain, half.labels)
        chain.each(watch.lap, ['coarse'])
        bands, validity = pool.parts(len(left)), self._refinement.validity
        chosen = self._search.search(chain, half.prior, previous_prior)

        def check(band):
            self._refinement.check(chosen, views.target_range, config, band)

        def fill(band):
            self._refinement.reject_speckles(config, band)
            self.population.fill(chosen.labels, validity, band)
        chain.each(check, bands)
        self._refinement.join_speckles(chain, chosen, config)
        chain.each(fill, bands)
        filled = chain.stages_so_far()
        if self._stages.mutation is not None:
            self._regions.gather(chain, chosen, validity, filled)
        self._fitness.set_pair(views.target_range)
        self.population.measure(chain, filled)
        if self._stages.mutation is not None:
            self._regions.mutate(chain, config.disparities, views.target_range,
                                 self.population.genes[0], Random((config.seed,)))
        chain.run()
        watch.lap(self._search.stage)
        budget = budget.reserving(self._durations[REFINING])
        operators = {} if self._stages.mutation is None else {'planes': self._mutate}
        history = evolve(self.population, operators, random, budget, observe, self._durations)
        best = self.population.genes[self.population.best]
        watch.lap('generations')
        inherited = False
        if config.warm_start:
            inherited = self.frames.inherit(
                pool, previous and previous.own.genes, warm.tile_history())
            planes = self.frames.evolve(best, chosen, validity, views, random.child(PLANES),
                                        budget, config.evolution_ms)
            history += [replace(row, number=row.number + len(history)) for row in planes]
            watch.lap('evolution')
        before = sum(watch.times.values())
        chain = Chain(pool)
        labels = self._refinement.smooth(chain, chosen.labels, best, views.full.left.grey)
        disparity, confidence = self._refinement.write(
            chain, labels, chosen, warm.prior_margins, config)
        if config.warm_start:
            warm.keep(chain, labels, self._refinement.final_validity)
        chain.run()
        watch.lap('refinement')
        match = Match(disparity, confidence, history, watch.times,
                      previous_prior is not None or inherited, warm.motion)
        if config.warm_start:
            state = warm.next_state(
                pool, self._refinement, self.frames.carried, config, match, previous)
            watch.lap('handing_on')
        self._durations.record(REFINING, sum(watch.times.values()) - before)
        return match, state

    def possibility_of(self, chromosome):
        """Return the possibility of a chromosome's matches: float32 (R, C), 0 to 1."""
        return self._fitness.possibility_of(self.pool, chromosome)

    def fitness_of(self, chromosome):
        """Return the fitness of a chromosome on the last pair, measured on every row."""
        return self._fitness.measure(self.pool, chromosome, every=1)[0]

    def _mutate(self, population, random):
        """Take the planes of regions of weak texture that are fitter."""
        population.accept(self.pool, self._crossover, random, self._regions.mutant)

    @property
    def noise(self):
        """The noise that averaging left in the last pair: grey levels, standard deviation."""
        return self._views.noise
