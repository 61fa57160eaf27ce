# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The genetic operators of the profile `paper`: selection, crossover, mutation, fusion.

Each is called as operator(tools, population, random) and changes the population in place; the
same random source gives the same bits for any number of threads. Of the uniform reading's
operators the paper has words for

* parents from the retained 40 %: "only the fittest individuals are retained (around 40%)";
  by rank: "sigmoid or rank functions are commonly used".
* regions instead of rows below a line: "exchanging a part of the matrices (Figure 2)"; that a
  region is only exchanged if the child gains by it, it does not say.
* patches that take one gene: "randomly changes one or several cells (a neighbouring N of uniform
  cells)"; 40 % of the children: "mutation rate is set to 40%". That a patch stays only if the
  fitness around it does not fall is the reading here of "affects matrix cells with lower matching
  possibilities".

It has none for fusion, by which the fittest takes from each of the other retained what makes it
fitter: a minimum cut finds the best of all children that two parents can have.
"""
from fuzzy_stereo_ros.matching.crossover import Cut, Exchange, PartitionCrossover
from fuzzy_stereo_ros.matching.kernels.genetic.exchange import differing_cells
from fuzzy_stereo_ros.matching.kernels.genetic.literal_reading import place_patches
from fuzzy_stereo_ros.matching.kernels.genetic.uniform_reading import (
    fill_exchange, fill_fitness_around, larger_halves, LARGEST_HALF, mutate_by_patches)
from fuzzy_stereo_ros.matching.paper.fitness import inside, Lineage
import numpy as np

ELITE = 0.4                 # share of the population that is retained
CELLS_A_PATCH = 48          # a mutation tries a patch for so many cells of the image
FEW_CELLS = 0.25            # share of the cells; parents that differ in more are not crossed
FIRST_FUSION = 0.5          # share of the generations before the first fusion
FUSIONS = 10                # in a whole run, of which those before it are left out


class OperatorTools:
    """What operators need: configuration, `ThreadPool`, fitness, and memory of each thread."""

    def __init__(self, config, pool, fitness, shape):
        """shape: (R + 2, W), of framed maps."""
        self.config, self.pool, self.fitness, self._shape = config, pool, fitness, shape
        self._crossings, self._fusion = [None] * pool.threads, None

    def each(self, size, work):
        """Call work(number, thread) for the numbers below size, shared among threads."""
        numbers = iter(range(size))

        def of_thread(thread):
            while (number := next(numbers, None)) is not None:
                work(number, thread)

        self.pool.each(of_thread, range(self.pool.threads))

    def crossing(self, thread):
        """Return the `Exchange` of a thread, and its `PartitionCrossover`."""
        if self._crossings[thread] is None:
            self._crossings[thread] = Exchange(*self._shape, 8), PartitionCrossover(*self._shape)
        return self._crossings[thread]

    def fusion(self):
        """Return an `Exchange`, and a `Cut`."""
        if self._fusion is None:
            self._fusion = self.crossing(0)[0], Cut(*self._shape, 8)
        return self._fusion


def fittest_first(fitness):
    """Return the order of a population, the fittest first; of equals the earlier: int64 (P,)."""
    return np.argsort(-fitness, kind='stable')


def elite_size(population):
    """Return how many of the fittest are retained; the fittest one always is."""
    return max(round(ELITE * population), 1)


def survivors(survival, draws):
    """Return the ranks, two at least, whose survival exceeds the draw: both float64 (n,)."""
    chosen = np.flatnonzero(survival > draws)
    return chosen if chosen.size >= 2 else np.arange(min(2, survival.size))


def parent_pairs(chosen, first_draws, second_draws):
    """Return two parents of each child, unlike if possible: int64 (n, 2); draws: below 1."""
    first = (first_draws * chosen.size).astype(np.int64)
    further = 1 + (second_draws * (chosen.size - 1)).astype(np.int64)
    return np.stack([chosen[first], chosen[(first + further) % chosen.size]], axis=1)


def select(tools, population, random):
    """Select parents: the fittest stay, their children replace the others, or one alone."""
    ranked = fittest_first(population.totals)
    retained = ranked[:elite_size(ranked.size)]
    children = ranked[retained.size:] if ranked.size > 1 else ranked
    draws = random.child(0).uniform(retained.size)
    survival = 1.0 - np.arange(retained.size) / retained.size      # by rank
    candidates = retained[survivors(survival, draws)]
    pairs = random.child(1).uniform(2 * children.size).reshape(2, -1)
    population.lineage = Lineage(children, parent_pairs(candidates, *pairs))
    population.generation += 1


def crossover_lines(rows, draws):
    """Return the line of each crossover, uniform in [1, R]: draws, float64, are below 1."""
    return 1 + (draws * rows).astype(np.int64)


def cross_at_lines(tools, population, random):
    """Give each child the rows above a random line from one parent, the rest from the other."""
    children, parents = population.lineage
    rows = population.genes.shape[1]
    lines = crossover_lines(rows, random.uniform(children.size))

    def cross(number, thread):
        child, (first, second), line = children[number], parents[number], lines[number]
        population.copy(child, first)
        for memory in (population.framed, population.chosen, population.details):
            start = line + (memory.shape[1] > rows)     # framed maps have a row before the first
            memory[child, start:] = memory[second, start:]
        population.evaluate(child, line - 1, min(line + 1, rows))

    tools.each(children.size, cross)


def cross_regions(tools, population, random):
    """Give each child its first parent's genes and, unless most differ, fitter regions."""
    children, parents = population.lineage

    def cross(number, thread):
        population.copy(children[number], parents[number, 0])
        take_over(tools, population, children[number], parents[number, 1],
                  *tools.crossing(thread), FEW_CELLS)

    tools.each(children.size, cross)


def take_over(tools, population, slot, other, exchange, crossover, most=1.0):
    """Give a chromosome what a crossover chooses of another's, if at most a share differs."""
    ours, theirs = population.chromosome(slot), population.chromosome(other)
    number = differing_cells(ours[0], theirs[0], exchange.all_cells)
    if not 0 < number <= most * population.genes[slot].size:
        return
    exchange.set_size(number)
    fill_exchange(ours[:2], theirs[:2], tools.fitness.weights, exchange.changes())
    change = crossover(exchange)
    if change < 0:
        exchange.take(ours[0], theirs[0])
        exchange.take(ours[1], theirs[1])
        fill_fitness_around(exchange.cells[exchange.taken], tools.fitness.weights, ours)
        population.totals[slot] -= change


def mutate_by_uniform_patches(tools, population, random):
    """Mutate a share of the children by patches; one stays unless the fitness around it falls."""
    children, fitness = population.lineage.children, tools.fitness
    patches = max(population.genes[0].size // CELLS_A_PATCH, 1)
    larger = larger_halves(min(tools.config.neighbourhood // 2, LARGEST_HALF))
    mutated = children[random.child(0).uniform(children.size) < tools.config.mutation_rate]

    def mutate(number, thread):
        slot = mutated[number]
        population.totals[slot] += mutate_by_patches(
            random.child(1, slot).key, patches, larger, fitness.planes, fitness.colours,
            fitness.weights, population.chromosome(slot))

    tools.each(mutated.size, mutate)


def fuse_retained(tools, population, random):
    """
    Fuse the fittest with each of the other retained, in some of the generations.

    None are fused in the first half of the run, in which they become different good ones;
    afterwards a tenth of it lies between two fusions.
    """
    number, planned = population.generation, tools.config.generations
    if number < FIRST_FUSION * planned or number % max(round(planned / FUSIONS), 1):
        return
    fittest, *others = fittest_first(population.totals)[:elite_size(
        len(population.totals))]
    for other in others:
        take_over(tools, population, fittest, other, *tools.fusion())


def patch_numbers(cells, neighbourhood, draws):
    """Return 1 to as many patches as cover a child once, small orders of magnitude as likely."""
    most = max(cells // neighbourhood**2, 1)
    return (float(most)**draws).astype(np.int64)


def least_possible_level(chosen, share):
    """Return the level below which cells are the share of the least possible, and that of ties."""
    rows, columns = chosen.shape
    until = np.bincount(chosen.reshape(-1), minlength=256).cumsum()
    wanted = share * rows * columns
    level = min(int(np.searchsorted(until, wanted)), 255)
    before = until[level - 1] if level else 0
    return level, (wanted - before) / max(until[level] - before, 1)


def mutate_least_possible(tools, population, random):
    """Put squares of N's size on each child's least possible cells, gain or not."""
    children, config = population.lineage.children, tools.config
    numbers = patch_numbers(population.genes[0].size, config.neighbourhood,
                            random.child(0).uniform(children.size))

    def mutate(number, thread):
        slot = children[number]
        genes, chosen = population.genes[slot], inside(population.chosen[slot])
        level, share_of_ties = least_possible_level(chosen, config.mutation_rate)
        place_patches(random.child(1, slot).key, numbers[number], config.neighbourhood,
                      config.disparities, chosen, level, share_of_ties, genes)
        population.evaluate(slot, 0, genes.shape[0])

    tools.each(children.size, mutate)
