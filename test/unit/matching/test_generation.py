# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A generation at full size: the genes of tiles and the choice among them, against their twin."""
from types import SimpleNamespace

from census_scene import random_map, seen, small_pair, twin_costs
from fuzzy_stereo_ros.matching.bands import Chain, ThreadPool
from fuzzy_stereo_ros.matching.kernels.possibility.costs import Prior, weight_of
from fuzzy_stereo_ros.matching.kernels.scanlines.tile_genes import (
    HALF_SIZE, MOST_GENES, PREVIOUS, SIDE)
from fuzzy_stereo_ros.matching.kernels.temporal.change_detection import TILE
from fuzzy_stereo_ros.matching.realtime.generation import Generation, GROW, parent_of
from fuzzy_stereo_ros.matching.realtime.possibility import FULL_SIZE
from fuzzy_stereo_ros.matching.realtime.scanlines import gene_type
from fuzzy_stereo_ros.matching.realtime.views import half_disparities
from hypothesis import given, settings, strategies as st
import numpy as np
import reference_census
import reference_generation as twins

WEIGHTS = np.array([0, weight_of(1, 2), weight_of(0, 6), weight_of(1, 5)], np.uint8)


class Selected:
    """A pair of a size, some parents of it, and what is selected, with the twin of that."""

    def __init__(self, shape, disparities, spread=4, min_disparity=0, seed=0, shift=(0, 0),
                 previous='full', threads=1, few=False, mutation=1):
        self.shape, self.disparities, self.spread, self.seed = shape, disparities, spread, seed
        left, right = small_pair(*shape, disparity=min(3, shape[1] - 1), seed=seed)
        possibility = seen(left, right, disparities, min_disparity)
        cells = tuple(max(side // 2, 1) for side in shape)
        half, older = self._prior(1), self._prior(2)
        found = self._map(cells, 3, disparities // 2, gene_type(-(-disparities // 2)))
        nowhere = None, TILE, (0, 0)
        parents = [(HALF_SIZE, one) for one in (
            (half.labels, None, 1, 1, 0, *nowhere),
            (found, None, 2, 2, GROW, *nowhere))[:1 if few else 2]]
        before = None
        if previous:
            kind, size, cell = {'full': (gene_type(disparities), shape, 1),
                                'cells': (np.uint16, cells, 2)}[previous]
            choices = random_map([-(-side // TILE) for side in shape], 3, seed, np.int8) - 1
            before = (self._map(size, 4, disparities, kind), random_map(size, 3, seed + 9), cell,
                      1, 0, choices.astype(np.int8) if cell == 1 else None, TILE, shift)
            parents.append((PREVIOUS, before))
        self.generation, pool = Generation(possibility, few, mutation), ThreadPool(threads)
        chain = Chain(pool)
        self.chosen = self.generation.chosen
        self.generation.select(
            chain, SimpleNamespace(prior=half, chosen=SimpleNamespace(labels=found)),
            before and parent_of(*before[:6], shift=shift),
            older if previous else None)
        chain.run()
        pool.close()
        self.genes, self.origins = twins.tile_genes(
            parents, shape, disparities, 2 * (half_disparities(disparities) - 1), SIDE, MOST_GENES,
            mutation)
        costs = twin_costs(left, right, disparities, min_disparity, FULL_SIZE)
        for prior in (half, *([older] if previous else [])):
            costs = costs + reference_census.prior_costs(*prior, disparities)
        grey = possibility.left.grey[:, :shape[1]]
        self.expected = twins.selected(
            costs, self.genes, *reference_census.jump_penalties(
                grey, reference_census.jump_table(FULL_SIZE)), FULL_SIZE.small, SIDE)

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


def check(*arguments, **options):
    found = Selected(*arguments, **options)
    origin = found.generation.origin_of_genes()
    for (row, column), labels in found.genes.items():
        tile = row * -(-found.shape[1] // SIDE) + column
        count = found.generation.counts[tile]
        assert found.generation.genes[tile, :count].tolist() == labels
        assert found.generation.origins[tile, :count].tolist() == found.origins[row, column]
        cells = np.s_[SIDE * row:SIDE * (row + 1), SIDE * column:SIDE * (column + 1)]
        known = dict(zip(labels, found.origins[row, column]))
        np.testing.assert_array_equal(origin[cells], np.vectorize(known.get)(
            found.expected[0][cells]))
    for name, values in zip(('labels', 'offsets', 'sums', 'margins'), found.expected):
        np.testing.assert_array_equal(getattr(found.chosen, name), values, name)
    np.testing.assert_array_equal(found.chosen.target, reference_census.chosen_by_target(
        found.expected[0], found.expected[2], found.chosen.target.shape[1] - found.shape[1]))


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 50), st.integers(1, 50), st.integers(1, 40) | st.sampled_from([256, 257]),
       st.integers(1, 40), st.integers(-60, 9), st.integers(0, 99),
       st.tuples(st.integers(-70, 70), st.integers(-70, 70)),
       st.sampled_from(['full', 'cells', None]), st.booleans(), st.integers(0, 1))
def test_any_size_range_and_parents_are_those_of_the_twin(
        rows, columns, disparities, spread, min_disparity, seed, shift, previous, few,
        mutation):
    check((rows, columns), disparities, spread, min_disparity, seed, shift, previous, few=few,
          mutation=mutation)


def test_more_genes_than_a_tile_can_have_leave_out_the_largest():
    check((20, 70), 700, spread=700)
