# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Variants of the profiles for the ablation: parts removed, or replaced by the paper's."""
from dataclasses import dataclass
from functools import partial

from fuzzy_stereo_ros.evaluation.matchers import Ours
from fuzzy_stereo_ros.matching import MatcherConfig
from fuzzy_stereo_ros.matching.kernels.possibility.costs import Prior, weight_of
from fuzzy_stereo_ros.matching.paper import operators
from fuzzy_stereo_ros.matching.paper.fitness import Lineage
from fuzzy_stereo_ros.matching.paper.matcher import Stages as PaperStages
from fuzzy_stereo_ros.matching.quality.matcher import Stages as QualityStages
from fuzzy_stereo_ros.matching.quality.operators import OPERATORS
from fuzzy_stereo_ros.matching.realtime.generation import InheritedGenes
from fuzzy_stereo_ros.matching.realtime.matcher import STAGES
from fuzzy_stereo_ros.matching.realtime.operators import NotMutated
from fuzzy_stereo_ros.matching.realtime.warm_start import WarmStart
import numpy as np


AS_IT_IS = 'as it is'


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


class OwnGenes(InheritedGenes):
    """
    A cell keeps to its own gene of the half-size chromosome, mutated by one.

    Genes of its neighbours cost 2 more for each px further away, up to 30: no cost of a match is
    above 18. It gets no gene of the previous best.
    """

    def select(self, chain, half):
        """Select as InheritedGenes does, with its own genes as both priors."""
        own = half.prior.labels
        held = Prior(own, np.full(own.shape, weight_of(1, 15), np.uint8))
        chain.each(self._hold, [held])
        return super().select(chain, half._replace(prior=held))

    def _hold(self, held):
        self.previous, self.prior = None, held


def _genetic(profile):
    """Return the variants of `realtime` or `fast`."""
    own = STAGES[MatcherConfig.from_profile(profile).planes]
    changes = {AS_IT_IS: {},
               'without the previous best': {'previous_best': WarmStart.no_previous_best},
               'without genes of neighbours': {'generation': OwnGenes},
               'without mutation by one': {'generation': partial(own.generation, mutation=0)}}
    if own is STAGES[True]:
        changes.update({'without planes': {'mutation': NotMutated},
                        'without votes of plain regions': {'vote': NotMutated}})
    return [Ours(name, profile, stages=own._replace(**stages)) for name, stages in changes.items()]


REALTIME, FAST = map(_genetic, ('realtime', 'fast'))


QUALITY = [Ours(name, 'quality', stages=stages) for name, stages in {
    AS_IT_IS: None,
    'no crossover: a proposal as a whole': QualityStages(
        crossover=lambda rows, columns, neighbours: WholeMember(rows, columns)),
    "the paper's line crossover": QualityStages(
        crossover=lambda rows, columns, neighbours: Line()),
    'no mutation': QualityStages(operators={
        name: operator for name, operator in OPERATORS.items() if name != 'segments'}),
    'no evidence asked for': QualityStages(evidence=lambda *_: None)}.items()]


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
    retained = order[:operators.elite_size(order.size)]
    others = order[retained.size:]
    draws = random.child(1).uniform(2 * others.size).reshape(2, -1)
    population.lineage = Lineage(others, operators.parent_pairs(retained, *draws))
    population.generation += 1


def no_mutation(tools, population, random):
    """Change nothing after crossover."""


def _times_of_a_population():
    """Return the number of children that mutate in a generation of the default population."""
    config = MatcherConfig.from_profile('paper')
    children = config.population - operators.elite_size(config.population)
    return round(config.mutation_rate * children)


ALONE = Ours(
    'one chromosome, as many mutations', 'paper', {'population': 1, 'mutation_rate': 1.0},
    PaperStages(crossover=copy_parents, fusion=None,
                mutation=Repeated(PaperStages().mutation, _times_of_a_population())))
# The operators of the uniform reading, one exchanged at a time, at equal work: as many patches.
PAPER_OPERATORS = [Ours(AS_IT_IS, 'paper'), ALONE, *(
    Ours(name, 'paper', stages=PaperStages(**stages)) for name, stages in {
        'no crossover: neither regions nor fusion': {'crossover': copy_parents, 'fusion': None},
        'no mutation': {'mutation': no_mutation},
        'no fusion': {'fusion': None},
        "the paper's line crossover, no fusion": {
            'crossover': operators.cross_at_lines, 'fusion': None},
        'no crossover of regions': {'crossover': copy_parents},
        'no selection': {'selection': select_blindly}}.items())]
