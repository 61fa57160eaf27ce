# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The record of an evolution: generation by generation of a pair, or frame by frame of a sequence.

Matching does not depend on it. The origin of genes follows from comparing a generation with the
previous one, and from what the algorithms keep of their parents.
"""
from dataclasses import dataclass, replace
from typing import NamedTuple

from fuzzy_stereo_ros.evaluation.scores import score
from fuzzy_stereo_ros.matching import StereoMatcher
from fuzzy_stereo_ros.matching.match import Match
import numpy as np

FIRST, SECOND, MUTATED = range(3)       # the origin of a gene, see Snapshot
ORIGINS = {
    'paper': {FIRST: 'first parent', SECOND: 'second parent', MUTATED: 'mutation'},
    'realtime': {FIRST: 'kept', MUTATED: 'planes of plain regions'},
    'quality': {FIRST: 'kept', MUTATED: 'planes of segments and tiles'},
    'frames': {FIRST: 'previous best', SECOND: 'half-size map', MUTATED: 'mutated by one'}}
SHOWN = 5           # most generations or frames in a figure
LANDMARKS = '1', '2', '5'       # generations 1, 2, 5, 10, 20, ... may be shown


@dataclass(frozen=True)
class Snapshot:
    """
    A generation, of which 0 is the initial population, or a frame, from 1.

    image: the reference image, of which all maps are. best: float32 (R, C), px, the fittest
    chromosome, of a frame the result. possibility: float32 (R, C), 0 to 1, of the chromosome.
    fitness: float64 (P,), of all chromosomes, higher is fitter.
    origin: uint8 (R, C), of the genes of one chromosome: of the fittest child in the paper's
    algorithm, else of the only one, which takes the fitter genes of mutants. FIRST, SECOND: from
    this parent; MUTATED: from mutation. Of a frame of `realtime` and `fast`: of the selected genes
    of tiles. None for the initial population and other frames.
    changed: float32 (R, C), 0 to 1, the share of the children that mutation changed there, of a
    frame 1 where the chromosome is another than that of the frame before.
    is_best: whether the chromosome of the origin is the fittest. match: of a frame, else None.
    """

    number: int
    image: np.ndarray
    best: np.ndarray
    possibility: np.ndarray
    fitness: np.ndarray
    origin: np.ndarray | None
    changed: np.ndarray
    is_best: bool = True
    match: Match | None = None


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
        evolved, origin, is_best = matcher.algorithm.population, None, False
        changed = np.zeros(population.shape[1:], np.float32)
        if former is not None and config.algorithm == 'paper':
            origin, child, changed = origin_of_fittest_child(
                former, population, evolved.fitness, evolved.lineage)
            retained = np.delete(evolved.fitness, evolved.lineage.children)
            is_best = bool(evolved.fitness[child] > retained.max(initial=-np.inf))
        elif former is not None:
            is_best = True
            origin = np.where(population[0] != former[0], MUTATED, FIRST).astype(np.uint8)
        observe(_snapshot(matcher, number, (left, right), population[evolved.best], origin,
                          changed, is_best))
        former = population.copy()

    matcher = StereoMatcher(replace(config, generations=0))
    matcher.match(left, right)
    take(0, matcher.algorithm.population.genes)
    matcher = StereoMatcher(config)
    return matcher.match(left, right, observe=take)


def observe_frames(config, pairs, observe):
    """Match pairs of images one after the other; observe(snapshot): called with each frame's."""
    matcher, before = StereoMatcher(config), None
    for number, images in enumerate(pairs, 1):
        match = matcher.match(*images)
        algorithm = matcher.algorithm
        best = algorithm.population.genes[algorithm.population.best].copy()
        same = before is not None and before.shape == best.shape
        # Generation.origin_of_genes counts from mutation to the previous best.
        origin = MUTATED - algorithm.origin_of_genes() if config.algorithm == 'realtime' else None
        observe(replace(_snapshot(
            matcher, number, images, best, origin,
            np.float32(best != before) if same else np.ones(best.shape, np.float32)),
            best=match.disparity, match=match))
        before = best


def _snapshot(matcher, number, images, best, origin, changed, is_best=True):
    """Return the Snapshot of a matcher; best: genes of the fittest chromosome, (R, C)."""
    config = matcher.config
    mirrored = config.reference == 'right'      # the search then is

    def upright(found):
        return np.ascontiguousarray(found[:, ::-1 if mirrored else 1])

    return Snapshot(
        number, images[mirrored], upright(best + np.float32(config.min_disparity)),
        upright(matcher.algorithm.possibility_of(best)),
        matcher.algorithm.population.fitness.copy(), None if origin is None else upright(origin),
        upright(changed), is_best)


class Row(NamedTuple):
    """The figures of a generation or a frame."""

    number: int
    best_fitness: float
    mean_fitness: float
    worst_fitness: float
    bad_1: float | None         # percentage off by more than 1 px, None without ground truth
    changed: float              # mean of the Snapshot's
    origins: dict | None        # {word of ORIGINS: share of the genes}, None without an origin
    warm: bool                  # of the Match of a frame, as its gains
    gains: dict


class Record:
    """
    The record of an evolution: figures of all generations or frames, Snapshots of some.

    config: its MatcherConfig. truth, mask: arguments of `scores.score`, or None. frames: their
    number, 0 if it is one of generations. profile: its name, for titles; None = that of the
    algorithm. rows: a Row for each so far.
    """

    def __init__(self, config, truth=None, mask=None, frames=0, profile=None):
        """Start without generations and frames."""
        self.config, self.truth, self.mask, self.frames = config, truth, mask, frames
        self.profile = profile or config.algorithm
        self.rows, self._kept, self.last = [], {}, None

    @property
    def count(self):
        """How many generations or frames there will be, at most."""
        return self.frames or self.config.generations

    @property
    def words(self):
        """What each origin of genes is called; {} where none is known."""
        if self.frames:
            return ORIGINS['frames'] if self.config.algorithm == 'realtime' else {}
        return ORIGINS[self.config.algorithm] if self.count else {}

    def changes(self, number):
        """Return whether anything may have changed in the generation or frame of a number."""
        return bool(self.frames) or (self.config.algorithm == 'paper' and number > 0)

    def add(self, snapshot):
        """Add the Snapshot of the next generation or frame."""
        wrong, origins, fitness = None, None, snapshot.fitness
        if self.truth is not None:
            wrong = score(snapshot.best, self.truth, self.mask).bad_dense[1.0]
        if snapshot.origin is not None:
            origins = {word: float(np.mean(snapshot.origin == code))
                       for code, word in self.words.items()}
        self.rows.append(Row(
            snapshot.number, float(fitness.max()), float(fitness.mean()), float(fitness.min()),
            wrong, float(snapshot.changed.mean()), origins,
            *((False, {}) if snapshot.match is None else (
                snapshot.match.warm, snapshot.match.gains))))
        self.last = snapshot
        if snapshot.number < SHOWN or str(snapshot.number).rstrip('0') in LANDMARKS:
            self._kept[snapshot.number] = snapshot

    def shown(self):
        """Return up to SHOWN Snapshots: the first two, the last, two between by equal factors."""
        kept = {**self._kept, self.last.number: self.last}
        if len(kept) > SHOWN:
            between = [min(self._kept, key=lambda number: abs(np.log(
                max(number, 1) / self.last.number**share))) for share in (1 / 3, 2 / 3)]
            kept = {number: kept[number] for number in sorted(
                {*list(kept)[:2], *between, self.last.number})}
        return list(kept.values())


def origin_of_fittest_child(former, population, fitness, lineage):
    """
    Return origin (R, C) and number of the fittest child of the paper's algorithm, and `changed`.

    Genes of both parents count as FIRST. Without children all genes of the fittest are FIRST.

    former, population: (P, R, C) of two generations. fitness: float64 (P,) of the newer one.
    lineage: its Lineage. For `changed` see Snapshot.
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
