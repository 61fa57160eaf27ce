# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A generation: the genes of tiles and the choice among them, against their twin."""
from types import SimpleNamespace

from census_scene import random_map, seen, small_pair, twin_costs
from fuzzy_stereo_ros.matching.bands import Chain, ThreadPool
from fuzzy_stereo_ros.matching.kernels.addresses import address_of
from fuzzy_stereo_ros.matching.kernels.possibility.costs import Prior, weight_of
from fuzzy_stereo_ros.matching.kernels.scanlines import selection
from fuzzy_stereo_ros.matching.kernels.scanlines.tile_genes import (
    HALF_SIZE, MOST_GENES, PREVIOUS, SIDE)
from fuzzy_stereo_ros.matching.kernels.temporal.change_detection import TILE
from fuzzy_stereo_ros.matching.realtime.generation import (
    AllLabels, gene_type, GROW, InheritedGenes, parent_of)
from fuzzy_stereo_ros.matching.realtime.possibility import FULL_SIZE, HALF_SIZE as BOXED
from fuzzy_stereo_ros.matching.realtime.views import half_disparities
from hypothesis import example, given, settings, strategies as st
import numpy as np
import reference_census
import reference_generation as twins

WEIGHTS = np.array([0, weight_of(1, 2), weight_of(0, 6), weight_of(1, 5)], np.uint8)


def twin_penalties(possibility, model):
    """Return P2 across and down, and P1."""
    return (*reference_census.jump_penalties(
        possibility.left.grey[:, :possibility.columns], reference_census.jump_table(model)),
        model.small)


class Selected:
    """A pair of a size, some parents of it, and what is selected, with the twin of that."""

    def __init__(self, shape, disparities, spread, min_disparity, seed, shift, previous, few,
                 mutation, model):
        self.shape, self.disparities, self.spread, self.seed = shape, disparities, spread, seed
        left, right = small_pair(*shape, disparity=min(3, shape[1] - 1), seed=seed)
        possibility = seen(left, right, disparities, min_disparity, model)
        cells = tuple(max(side // 2, 1) for side in shape)
        half, older, nowhere = self._prior(1), self._prior(2), (None, TILE, (0, 0))
        found, labels = (self._map(cells, number, disparities // 2,
                                   gene_type(-(-disparities // 2))) for number in (3, 5))
        # A smaller size has no priors: sums of 3 x 3 pixels would contain them.
        smooth = (labels, None, 2, 2, 0) if model.box else (half.labels, None, 1, 1, 0)
        parents = [(HALF_SIZE, (*one, *nowhere)) for one in (
            smooth, (found, None, 2, 2, GROW))[:1 if few else 2]]
        before = None
        if previous:
            kind, size, cell = {'full': (gene_type(disparities), shape, 1),
                                'cells': (np.uint16, cells, 2)}[previous]
            choices = random_map([-(-side // TILE) for side in shape], 3, seed, np.int8) - 1
            before = (self._map(size, 4, disparities, kind), random_map(size, 3, seed + 9), cell,
                      1, 0, choices.astype(np.int8) if cell == 1 else None, TILE, shift)
            parents.append((PREVIOUS, before))
        self.generation, chain = InheritedGenes(possibility, few, mutation), Chain(ThreadPool(1))
        generation = self.generation
        for memory in (*generation._memory, generation._lines, generation._squares):
            memory[:] = 255 * (seed % 2)        # of the generation before nothing counts
        generation.select(
            chain, SimpleNamespace(
                labels=labels, prior=None if model.box else half,
                chosen=SimpleNamespace(labels=found), disparities=half_disparities(disparities)),
            before and parent_of(*before[:6], shift=shift),
            older if previous and not model.box else None)
        chain.run()
        self.genes, self.origins = twins.tile_genes(
            parents, shape, disparities, 2 * (half_disparities(disparities) - 1), SIDE, MOST_GENES,
            mutation)
        costs = twin_costs(left, right, disparities, min_disparity, model)
        for prior in () if model.box else (half, older) if previous else (half,):
            costs = costs + reference_census.prior_costs(*prior, disparities)
        self.expected = twins.selected(
            costs, self.genes, *twin_penalties(possibility, model), SIDE)

    def _map(self, shape, number, limit, kind):
        """Return a map whose labels spread little, in blocks, so that tiles differ."""
        blocks = random_map(tuple(-(-side // 16) for side in shape), max(limit, 1),
                            self.seed + number, np.int64)
        labels = blocks.repeat(16, 0).repeat(16, 1)[:shape[0], :shape[1]] + random_map(
            shape, self.spread, self.seed + number, np.int64)
        return np.minimum(labels, max(limit - 1, 0)).astype(kind)

    def _prior(self, number):
        return Prior(self._map(self.shape, number, self.disparities, gene_type(self.disparities)),
                     WEIGHTS[random_map(self.shape, len(WEIGHTS), self.seed + number)])


def check_chosen(chosen, expected):
    for name, values in zip(('labels', 'offsets', 'sums', 'margins'), expected):
        np.testing.assert_array_equal(getattr(chosen, name), values, name)
    np.testing.assert_array_equal(chosen.target, reference_census.chosen_by_target(
        expected[0], expected[2], chosen.target.shape[1] - chosen.labels.shape[1]))


@settings(max_examples=40)
@given(st.integers(1, 50), st.integers(1, 50), st.integers(1, 40) | st.sampled_from([256, 257]),
       st.integers(1, 40), st.integers(-60, 9), st.integers(0, 99),
       st.tuples(st.integers(-70, 70), st.integers(-70, 70)),
       st.sampled_from(['full', 'cells', None]), st.booleans(), st.integers(0, 1),
       st.sampled_from([FULL_SIZE, BOXED]))
@example(20, 70, 700, 700, 0, 0, (0, 0), 'full', False, 1, FULL_SIZE)   # more than a tile can have
@example(3, 600, 600, 600, 0, 0, (0, 0), 'full', False, 1, FULL_SIZE)   # 256 apart at a target
def test_any_size_range_and_parents_are_those_of_the_twin(
        rows, columns, disparities, spread, min_disparity, seed, shift, previous, few,
        mutation, model):
    found = Selected((rows, columns), disparities, spread, min_disparity, seed, shift, previous,
                     few, mutation, model)
    origin = found.generation.origin_of_genes()
    for number, ((row, column), labels) in enumerate(found.genes.items()):
        count, origins = found.generation.counts[number], found.origins[row, column]
        assert found.generation.genes[number, :count].tolist() == labels
        assert found.generation.origins[number, :count].tolist() == origins
        cells = np.s_[SIDE * row:SIDE * (row + 1), SIDE * column:SIDE * (column + 1)]
        np.testing.assert_array_equal(origin[cells], np.vectorize(
            dict(zip(labels, origins)).get)(found.expected[0][cells]))
    check_chosen(found.generation.chosen, found.expected)


@settings(max_examples=40)
@given(st.integers(1, 700), st.integers(1, 700), st.integers(-60, 60), st.integers(1, 8),
       st.integers(0, 9))
def test_pixels_of_any_labels_compete_for_the_target_as_those_of_the_twin_do(
        columns, disparities, min_disparity, classes, seed):
    possibility = seen(*small_pair(2, columns, min(3, columns - 1)), disparities, min_disparity)
    search, random = AllLabels(possibility), np.random.default_rng(seed)
    labels, _, sums, _, target = search.chosen
    labels[:] = random.integers(0, disparities, labels.shape)
    sums[:] = 255 - random.integers(0, classes, sums.shape) * 255 // classes
    selection.select_of_target(search._found, search._scratch[0], columns,
                               address_of(target), target.shape[1], 0, 2)
    assert np.array_equal(target, reference_census.chosen_by_target(
        labels, sums, target.shape[1] - columns))
