# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Variants of the profiles for the ablation: parts removed, or replaced by those of the paper.

A variant changes parameters or replaces stages. The replacements are written to be compared with,
not to be fast.
"""
from dataclasses import dataclass, field
from functools import partial

from fuzzy_stereo_ros.evaluation.matchers import Ours
from fuzzy_stereo_ros.matching import MatcherConfig
from fuzzy_stereo_ros.matching.crossover import Regions
from fuzzy_stereo_ros.matching.over_frames.inheritance import Inheritance
from fuzzy_stereo_ros.matching.paper import operators
from fuzzy_stereo_ros.matching.paper.matcher import PaperState, Stages as PaperStages
from fuzzy_stereo_ros.matching.paper.population import Lineage
from fuzzy_stereo_ros.matching.paper.possibility import GREY_CENTRES, membership
from fuzzy_stereo_ros.matching.quality.matcher import Stages as QualityStages
from fuzzy_stereo_ros.matching.quality.operators import OPERATORS
from fuzzy_stereo_ros.matching.realtime.generation import Generation
from fuzzy_stereo_ros.matching.realtime.matcher import Stages as RealtimeStages
from fuzzy_stereo_ros.matching.realtime.operators import NotMutated
from fuzzy_stereo_ros.matching.realtime.possibility import CensusPicture
from fuzzy_stereo_ros.matching.realtime.warm_start import WarmStart
import numpy as np

_BITS = 8           # of a byte plane: steps of a membership
_SIGMA = 54.0       # grey levels, standard deviation of the paper's classes


@dataclass(frozen=True)
class Variant:
    """
    A profile with a part removed or replaced.

    changes: {parameter: value}. stages: of the profile's matcher, None = its own. still, moving:
    whether it differs from the default on single scenes, and on sequences. timed: whether its
    time is worth printing. part: the removed part of the genetic algorithm, '' if another one.
    """

    name: str
    changes: dict = field(default_factory=dict)
    stages: object = None
    still: bool = True
    moving: bool = True
    timed: bool = True
    part: str = ''

    def matcher(self, profile, disparities, changes=None):
        """Return its `StereoMatcher`; changes: {parameter: value} of the matcher under test."""
        return Ours(self.name, profile, {**(changes or {}), **self.changes}, self.stages).matcher(
            disparities)


class WholeMember:
    """No crossover of parts: takes the second parent as a whole if it is fitter."""

    def __init__(self, rows, columns):
        """Need no memory."""

    def __call__(self, exchange, random=None):
        """Choose all cells or none; return the change of cost, not above 0."""
        change = min(int(exchange.alone.sum() + exchange.pairs.sum()), 0)
        exchange.taken[:] = change < 0
        return change


class Line:
    """The paper's crossover: the second parent's genes below a random line, fitter or not."""

    def __call__(self, exchange, random):
        """Choose the cells; return the change of cost."""
        rows = exchange.cells // exchange.shape[1]
        line = int(random.uniform(1)[0] * exchange.shape[0])
        exchange.taken[:] = rows >= line
        # all neighbours but the left one are a row further up
        return int(exchange.alone[rows >= line].sum() + exchange.pairs[rows >= line, 0].sum()
                   + exchange.pairs[rows > line, 1:].sum())


class NoNoise:
    """No estimate of noise: all differences of grey count."""

    level = 0.0

    def __init__(self, rows, columns):
        """Need no memory."""

    def measure(self, full, half, first, last):
        """Measure nothing."""


class NoEvidence:
    """No evidence of the images alone: a region moves where that is fitter."""

    def __init__(self, rows, columns):
        """Need no memory."""

    def reject(self, *_):
        """Reject nothing."""


class BestInherited(Inheritance):
    """The next frame gets the fittest chromosome alone, in all places of the population."""

    def next_state(self, labels, confidence, own, config):
        """Return the FrameState of the fittest."""
        return super().next_state(labels, confidence, PaperState(own.genes[:1].copy()), config)


class NothingHandedOn(Inheritance):
    """Pictures are averaged, but no map is handed on: each frame begins with its own."""

    def average(self, pool, state, camera):
        """Average the pictures; return that no maps are inherited."""
        super().average(pool, state, camera)
        return False


def describe_by_grey_classes(view, first, last):
    """
    Write the paper's three grey classes instead of census and gradient.

    The code of a pixel has a bit for each eighth of membership in each class, Eq. 1. Memberships
    sum to about one, so the Hamming distance of two codes is 16 (1 - possibility) with the
    possibility of Eq. 2, but with the bounded sum instead of the maximum as fuzzy OR.
    """
    CensusPicture.describe(view, first, last)
    within = np.minimum(np.arange(view.census.shape[2]), view.columns - 1)
    for plane, centre in enumerate(GREY_CENTRES):
        degree = membership(np.arange(256), centre, _SIGMA)
        codes = ((1 << np.rint(_BITS * degree).astype(np.int64)) - 1).astype(np.uint8)
        view.census[first:last, plane] = codes[view.grey[first:last]][:, within]
    view.slopes[first:last] = 128


DEFAULT = Variant('as it is')
NO_PREVIOUS_BEST = 'previous frames averaged, no previous best'
NOT_FOLLOWED = 'previous frames, the camera is not followed'
REALTIME = (
    DEFAULT,
    Variant('no crossover: the fitter chromosome as a whole',
            stages=RealtimeStages(crossover=WholeMember), part='crossover'),
    Variant("the paper's line crossover", stages=RealtimeStages(
        crossover=lambda rows, columns: Line())),
    Variant('no mutation: neither planes nor votes of plain regions',
            stages=RealtimeStages(mutation=NotMutated, vote=NotMutated), part='mutation'),
    Variant('genes of tiles not mutated by one',
            stages=RealtimeStages(generation=partial(Generation, mutation=0)), part='mutation'),
    Variant('genes of the smoothed half-size chromosome of the tile itself alone',
            stages=RealtimeStages(generation=partial(Generation, few=True)), part='crossover'),
    Variant('no planes of plain regions', stages=RealtimeStages(mutation=NotMutated)),
    Variant('no vote of plain regions', stages=RealtimeStages(vote=NotMutated)),
    Variant('noise ignored', stages=RealtimeStages(noise=NoNoise)),
    Variant('no previous frames', {'warm_start': False}, still=False),
    Variant(NO_PREVIOUS_BEST,
            stages=RealtimeStages(previous_best=WarmStart.no_previous_best), still=False,
            part='previous best'),
    Variant(NOT_FOLLOWED, still=False),         # its frames have no calibration
    Variant("the paper's possibility, three grey classes",
            stages=RealtimeStages(describe=describe_by_grey_classes), timed=False),
)


def _quality_without(*names):
    """Return the stages of `quality` without the named operators."""
    return QualityStages(operators={name: operator for name, operator in OPERATORS.items()
                                    if name not in names})


QUALITY = (
    DEFAULT,
    Variant('no crossover: a proposal as a whole', stages=QualityStages(
        crossover=lambda rows, columns, neighbours: WholeMember(rows, columns)),
            part='crossover'),
    Variant("the paper's line crossover", stages=QualityStages(
        crossover=lambda rows, columns, neighbours: Line())),
    Variant('partition crossover', stages=QualityStages(
        crossover=lambda rows, columns, neighbours: Regions(rows, columns))),
    Variant('no mutation', stages=_quality_without('segments', 'tiles'), part='mutation'),
    Variant('no planes of segments', stages=_quality_without('segments')),
    Variant('no planes of tiles', stages=_quality_without('tiles')),
    Variant('no evidence asked for', stages=QualityStages(evidence=NoEvidence)),
    Variant('views judge each other at the start alone', stages=_quality_without('trust')),
    Variant(NO_PREVIOUS_BEST, stages=QualityStages(inheritance=NothingHandedOn), still=False,
            part='previous best'),
)


@dataclass(frozen=True)
class Repeated:
    """An operator that applies another one several times."""

    operator: object
    times: int

    def __call__(self, tools, population, random):
        """Apply the operator."""
        for turn in range(self.times):
            self.operator(tools, population, random.child(turn))


def copy_parents(tools, population, random):
    """Make each child a copy of its first parent: no crossover."""
    children, parents = population.lineage

    def copy(number, thread):
        population.copy(children[number], parents[number, 0])

    tools.each(children.size, copy)


def select_blindly(tools, population, random):
    """Retain as many chromosomes as selection would, chosen at random, as equal parents."""
    order = np.argsort(random.child(0).uniform(len(population.genes)))
    retained = order[:operators.elite_size(order.size, tools.config.elite)]
    others = order[retained.size:]
    draws = random.child(1).uniform(2 * others.size).reshape(2, -1)
    population.lineage = Lineage(others, operators.parent_pairs(retained, *draws))
    population.generation += 1


def no_mutation(tools, population, random):
    """Change nothing after crossover."""


def _times_of_a_population():
    """Return the number of children that mutate in a generation of the default population."""
    config = MatcherConfig.from_profile('paper')
    children = config.population - operators.elite_size(config.population, config.elite)
    return round(config.mutation_rate * children)


ALONE = Variant(
    'one chromosome, as many mutations', {'population': 1, 'mutation_rate': 1.0},
    PaperStages(crossover=copy_parents, fusion=None,
                mutation=Repeated(PaperStages().mutation, _times_of_a_population())),
    part='population')
NO_CROSSOVER = Variant('no crossover: neither regions nor fusion',
                       stages=PaperStages(crossover=copy_parents, fusion=None),
                       part='crossover')
ONLY_BEST = Variant('only the best is handed on', stages=PaperStages(inheritance=BestInherited),
                    still=False, part='population')
NO_FUSION = Variant('no fusion', stages=PaperStages(fusion=None))
LINE_CROSSOVER = Variant("the paper's line crossover, no fusion", stages=PaperStages(
    crossover=operators.cross_at_lines, fusion=None))
NO_MUTATION = Variant('no mutation', stages=PaperStages(mutation=no_mutation), part='mutation')
ON_A_PAIR = DEFAULT, ALONE, NO_CROSSOVER, NO_MUTATION
PAPER = (*ON_A_PAIR, ONLY_BEST, Variant(
    NO_PREVIOUS_BEST, stages=PaperStages(inheritance=NothingHandedOn), still=False,
    part='previous best'))
# The operators of the uniform reading, one exchanged at a time, at equal work: as many patches.
PAPER_OPERATORS = (
    *ON_A_PAIR, NO_FUSION, LINE_CROSSOVER,
    Variant('no crossover of regions', stages=PaperStages(crossover=copy_parents)),
    Variant('no selection', stages=PaperStages(selection=select_blindly)))


class InPlace(Inheritance):
    """The population stays where it was, however the picture moved."""

    def average(self, pool, state, camera):
        """Average the pictures, and take all cells from their own places."""
        inherited = super().average(pool, state, camera)
        self._origins[:] = np.arange(self._origins.size).reshape(self._origins.shape)
        return inherited


class NotAveraged(Inheritance):
    """Each frame sees its own pictures alone."""

    def average(self, pool, state, camera):
        """Compare the pictures with the previous ones, and undo what is averaged."""
        pictures = *self.views, *self._channels
        own = [(view.luminance.copy(), view.grey.copy()) for view in pictures]
        inherited = super().average(pool, state, camera)
        for view, (luminance, grey) in zip(pictures, own):
            view.luminance[:], view.grey[:] = luminance, grey
        return inherited


# Of the profile paper_live over frames: 48 chromosomes mutate a frame, as two of four do 24 times.
PAPER_OVER_FRAMES = (
    DEFAULT,
    ONLY_BEST,
    Variant('population of 1', {'population': 1, 'generations': 48},
            PaperStages(crossover=copy_parents, fusion=None)),
    Variant('population of 16', {'population': 16, 'generations': 5}),
    NO_CROSSOVER, NO_FUSION, LINE_CROSSOVER, NO_MUTATION,
    Variant('not moved with the picture', stages=PaperStages(inheritance=InPlace)),
    Variant('N does not rise with the map', stages=PaperStages(slopes=None)),
    Variant('pictures not averaged', stages=PaperStages(inheritance=NotAveraged)),
    Variant('begun with the most possible genes', {'initial_population': 'winner_takes_all'}),
)
