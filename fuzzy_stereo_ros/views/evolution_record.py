# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The record of an evolution, generation by generation, and of a sequence, frame by frame.

Matching does not depend on it. The origin of genes follows from comparing a generation with the
previous one, and from the lineage that the paper's algorithm keeps.
"""
from dataclasses import dataclass, replace
from typing import NamedTuple

from fuzzy_stereo_ros.evaluation.scores import score
from fuzzy_stereo_ros.matching import StereoMatcher
import numpy as np

FIRST, SECOND, MUTATED = range(3)       # the origin of a gene, see Snapshot
# the same in a frame of `realtime`, as Generation.origin_of_genes numbers them
ORIGINS = 'mutated by one', 'half-size map', 'previous best'
SHOWN = 5           # most generations of an evolution in a figure
FRAMES_SHOWN = 4    # most frames of a sequence in a figure
LANDMARKS = '1', '2', '5'       # generations 1, 2, 5, 10, 20, ... may be shown


@dataclass(frozen=True)
class Snapshot:
    """
    A generation; number 0 is the initial population. Maps are of the reference image.

    best: float32 (R, C), px, the fittest chromosome. possibility: float32 (R, C), 0 to 1, of it.
    fitness: float64 (P,), of all chromosomes, higher is fitter.
    origin: uint8 (R, C), of the genes of one chromosome: of the fittest child in the paper's
    algorithm, else of the only chromosome, which takes the fitter genes of mutants. FIRST, SECOND:
    from this parent; MUTATED: from mutation. None for the initial population.
    is_best: whether that chromosome is the fittest of all.
    mutated: float32 (R, C), 0 to 1, the share of the children that mutation changed there.
    """

    number: int
    best: np.ndarray
    possibility: np.ndarray
    fitness: np.ndarray
    origin: np.ndarray | None
    is_best: bool
    mutated: np.ndarray


def observed_match(config, left, right, observe):
    """
    Match a pair cold and return its Match, which observing does not change.

    config: MatcherConfig; its deadline is ignored, as observing takes time.
    left, right: images of StereoMatcher.match. observe(snapshot): called with the Snapshot of the
    initial population and of each generation. Raises ValueError as StereoMatcher.match does.
    """
    config, former = replace(config, deadline_ms=0.0), None

    def take(number, population):
        nonlocal former
        observe(_snapshot(config, number, matcher.algorithm, former, population))
        former = population.copy()

    matcher = StereoMatcher(replace(config, generations=0))
    matcher.match(left, right)
    take(0, matcher.algorithm.population.genes)
    matcher = StereoMatcher(config)
    return matcher.match(left, right, observe=take)


class Row(NamedTuple):
    """The fitness of a generation, and the error of its best chromosome."""

    number: int
    best_fitness: float
    mean_fitness: float
    worst_fitness: float
    bad_1: float | None         # percentage off by more than 1 px, None without ground truth


class Convergence:
    """
    The convergence of an evolution: figures of all generations, Snapshots of some.

    config: its MatcherConfig. image: the reference image. truth, mask: arguments of
    `scores.score`, or None. rows: a Row for each generation so far.
    """

    def __init__(self, config, image, truth=None, mask=None):
        """Start without generations."""
        self.config, self.image, self.truth, self.mask = config, image, truth, mask
        self.rows, self._kept, self._last = [], {}, None

    def add(self, snapshot):
        """Add the Snapshot of the next generation."""
        wrong = None if self.truth is None else score(
            snapshot.best, self.truth, self.mask).bad_dense[1.0]
        fitness = snapshot.fitness
        self.rows.append(Row(snapshot.number, float(fitness.max()), float(fitness.mean()),
                             float(fitness.min()), wrong))
        self._last = snapshot
        if snapshot.number < SHOWN or str(snapshot.number).rstrip('0') in LANDMARKS:
            self._kept[snapshot.number] = snapshot

    def shown(self):
        """Return up to SHOWN Snapshots: 0, 1, the last, and two between them by equal factors."""
        last = self._last.number
        if last < SHOWN:
            return list(self._kept.values())
        between = [min(self._kept, key=lambda number: abs(np.log(max(number, 1) / last**share)))
                   for share in (1 / 3, 2 / 3)]
        return [self._kept[number] for number in (0, 1, *between)] + [self._last]


def mutates(config, number):
    """Return whether a MatcherConfig has mutation in the generation of a number."""
    return config.algorithm == 'paper' and number > 0


def _snapshot(config, number, algorithm, former, population):
    """Return the Snapshot of an algorithm; former, population: (P, R, C) of two generations."""
    def upright(found):
        """Return a map of the reference image: with the right one the search is mirrored."""
        return np.ascontiguousarray(found[:, ::-1 if config.reference == 'right' else 1])

    evolved, best = algorithm.population, population[algorithm.population.best]
    origin, is_best, mutated = None, False, np.zeros(best.shape, np.float32)
    if former is not None and config.algorithm == 'paper':
        origin, child, mutated = origin_of_fittest_child(
            former, population, evolved.fitness, evolved.lineage)
        retained = np.delete(evolved.fitness, evolved.lineage.children)
        is_best = bool(evolved.fitness[child] > retained.max(initial=-np.inf))
    elif former is not None:
        is_best = True
        origin = np.where(population[0] != former[0], MUTATED, FIRST).astype(np.uint8)
    return Snapshot(number, upright(best + np.float32(config.min_disparity)),
                    upright(algorithm.possibility_of(best)), evolved.fitness.copy(),
                    None if origin is None else upright(origin), is_best, upright(mutated))


def origin_of_fittest_child(former, population, fitness, lineage):
    """
    Return origin (R, C) and number of the fittest child of the paper's algorithm, and `mutated`.

    Genes of both parents count as FIRST. Without children all genes of the fittest are FIRST.

    former, population: (P, R, C) of two generations. fitness: float64 (P,) of the newer one.
    lineage: its Lineage. For `mutated` see Snapshot.
    """
    shape = population.shape[1:]
    if not lineage.children.size:
        return np.full(shape, FIRST, np.uint8), int(fitness.argmax()), np.zeros(shape, np.float32)
    fittest = lineage.children[fitness[lineage.children].argmax()]
    counts = np.zeros(shape, int)
    for child, parents in zip(lineage.children, lineage.parents):
        of_first, of_second = (population[child] == former[parent] for parent in parents)
        changed = ~of_first & ~of_second
        counts += changed
        if child == fittest:
            origin = np.where(of_first, FIRST, SECOND).astype(np.uint8)
            origin[changed] = MUTATED
    return origin, int(fittest), (counts / lineage.children.size).astype(np.float32)


@dataclass(frozen=True)
class Frame:
    """
    A frame of a sequence; maps are those of the matcher: mirrored for the right reference.

    number: from 1. image: the reference image. disparity: float32 (R, C), px. evolved: bool
    (R, C), where the best chromosome is another than that of the frame before. beside: float32
    (R, C), the possibility of the best chromosome. origin: uint8 (R, C), an index of ORIGINS, of
    the genes that `realtime` and `fast` have selected, else None. fitness: of the best. gains:
    fitness by operator. warm: see Match. wrong: percentage off by more than 1 px, None without
    truth.
    """

    number: int
    image: np.ndarray
    disparity: np.ndarray
    evolved: np.ndarray
    beside: np.ndarray
    origin: np.ndarray | None
    fitness: float
    gains: dict
    warm: bool
    wrong: float | None

    @property
    def figures(self):
        """The figures of the frame for JSON."""
        return {'frame': self.number, 'warm': self.warm, 'fitness': self.fitness,
                'gains': self.gains, 'bad_1': self.wrong, 'evolved': float(self.evolved.mean()),
                'origins': None if self.origin is None else dict(zip(ORIGINS, (np.bincount(
                    self.origin.ravel(), minlength=len(ORIGINS)) / self.origin.size).tolist()))}


def watched_frames(config, pairs, truth=None, mask=None):
    """
    Yield a `Frame` for each pair of images, matched one after the other.

    config: MatcherConfig with warm_start. truth, mask: of all frames.
    """
    matcher, before = StereoMatcher(config), None
    for number, (left, right) in enumerate(pairs, 1):
        match = matcher.match(left, right)
        algorithm = matcher.algorithm
        best = algorithm.population.genes[algorithm.population.best].copy()
        same = before is not None and before.shape == best.shape
        maps = (best != before if same else np.ones(best.shape, bool),
                algorithm.possibility_of(best),
                algorithm.origin_of_genes() if config.algorithm == 'realtime' else None)
        before = best
        wrong = None if truth is None else score(match.disparity, truth, mask).bad_dense[1.0]
        yield Frame(number, left if config.reference == 'left' else right, match.disparity, *maps,
                    float(algorithm.population.fitness.max()), match.gains, match.warm, wrong)


def shown_frames(frames):
    """Return up to FRAMES_SHOWN frames: the first, the last, others between by equal factors."""
    last = len(frames)
    numbers = sorted({round(last**(place / (FRAMES_SHOWN - 1))) for place in range(FRAMES_SHOWN)})
    return [frames[number - 1] for number in numbers]
