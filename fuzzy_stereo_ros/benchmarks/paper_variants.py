# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The operators of the uniform reading, one exchanged at a time, at equal work.

Equal work: the same number of tried patches. One chromosome gets all that a population would try.
"""
from dataclasses import dataclass, replace

from fuzzy_stereo_ros.matching.paper import operators
from fuzzy_stereo_ros.matching.paper.matcher import Stages
from fuzzy_stereo_ros.matching.paper.population import Kinship
import numpy as np


@dataclass(frozen=True)
class PaperVariant:
    """
    A variant in words.

    stages: its `Stages`; alone: whether one chromosome does the work of the population
    """

    name: str
    stages: Stages
    alone: bool = False

    def config(self, config):
        """Return a configuration as the variant has it."""
        return replace(config, population=1, mutation_rate=1.0) if self.alone else config

    def stages_for(self, config):
        """Return the stages, which do as much as those of the configuration."""
        if not self.alone:
            return self.stages
        children = config.population - operators.elite_size(config.population, config.elite)
        times = max(round(config.mutation_rate * children), 1)
        return self.stages._replace(mutation=Repeated(self.stages.mutation, times))


@dataclass(frozen=True)
class Repeated:
    """An operator that does another one a number of times."""

    operator: object
    times: int

    def __call__(self, tools, population, random):
        """Do it."""
        for turn in range(self.times):
            self.operator(tools, population, random.child(turn))


def select_from_all(tools, population, random):
    """Select among all chromosomes, without islands."""
    population.islands = [np.arange(len(population.genes))]
    operators.select(tools, population, random)


def select_blindly(tools, population, random):
    """Retain as many as selection would, whoever they are; all of them are as likely to mate."""
    order = np.argsort(random.child(0).uniform(len(population.genes)))
    retained = order[:operators.elite_size(order.size, tools.config.elite)]
    others = order[retained.size:]
    draws = random.child(1).uniform(2 * others.size).reshape(2, -1)
    population.kinship = Kinship(others, operators.couples(retained, *draws))
    population.generation += 1


def cross_by_cut(tools, population, random):
    """Fuse the parents of each child by a minimum cut, unless they are too unlike."""
    operators.copy_parents(tools, population, random)
    for child, (_, second) in zip(*population.kinship):
        operators.take_over(tools, population, child, second, *tools.fusion(),
                            operators.FEW_CELLS)


def no_mutation(tools, population, random):
    """Leave the children as crossover made them."""


ALL = Stages()
ALONE = PaperVariant('one chromosome, as many mutations',
                     ALL._replace(crossover=operators.copy_parents, migration=None), alone=True)
VARIANTS = (
    PaperVariant('as it is: islands, regions, fusion between islands', ALL),
    ALONE,
    PaperVariant('one population: no islands',
                 ALL._replace(selection=select_from_all, migration=None)),
    PaperVariant('one population, line crossover',
                 ALL._replace(selection=select_from_all, crossover=operators.cross_at_lines,
                              migration=None)),
    PaperVariant('one population, fusion by cut',
                 ALL._replace(selection=select_from_all, crossover=cross_by_cut,
                              migration=None)),
    PaperVariant('one population, no crossover',
                 ALL._replace(selection=select_from_all, crossover=operators.copy_parents,
                              migration=None)),
    PaperVariant('islands without migration', ALL._replace(migration=None)),
    PaperVariant('islands without crossover of regions',
                 ALL._replace(crossover=operators.copy_parents)),
    PaperVariant('no selection', ALL._replace(selection=select_blindly, migration=None)),
    PaperVariant('no mutation', ALL._replace(mutation=no_mutation)),
)
