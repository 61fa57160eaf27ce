# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Kernels of the uniform reading: weights, mutation."""
from fuzzy_stereo_ros.matching.kernels.genetic.random_numbers import key_of
from fuzzy_stereo_ros.matching.kernels.genetic.uniform_reading import (
    fill_chosen, fill_fitness, fill_neighbour_weights, FRAME, larger_halves, LARGEST_HALF,
    mutate_by_patches, UNIFORM, WEIGHTS)
from fuzzy_stereo_ros.matching.paper.fitness import inside
from fuzzy_stereo_ros.matching.paper.possibility import uniform_membership
from hypothesis import given, settings, strategies as st
import numpy as np
import pytest
import reference


class Scene:
    """Random possibilities, colours and weights, framed, and chromosomes of them."""

    def __init__(self, shape, seed=0, colours=(90, 120)):
        self.random = np.random.default_rng(seed)
        self.shape, framed = shape, (shape[0] + 2, shape[1] + FRAME)
        self.planes = np.zeros((6, *framed), np.uint8)
        inside(self.planes)[:] = self.random.integers(0, 256, (6, *shape))
        self.colours = np.zeros((3, *framed), np.uint8)
        inside(self.colours)[:] = self.random.integers(*colours, (3, *shape))
        self.weights = np.zeros((8, *framed), np.uint8)
        fill_neighbour_weights(self.colours, uniform_membership(), 0, shape[0], self.weights)

    def chromosome(self, genes=None):
        """Return framed genes, chosen, fitness, and its sum."""
        framed = np.zeros(self.planes.shape[1:], np.uint16)
        inside(framed)[:] = self.random.integers(0, 6, self.shape) \
            if genes is None else genes
        chosen, fitness = np.zeros(framed.shape, np.uint8), np.zeros(framed.shape, np.uint16)
        fill_chosen(self.planes, framed, 0, self.shape[0], chosen)
        total = fill_fitness(framed, chosen, self.weights, self.shape[1], 0, self.shape[0],
                             fitness)
        return framed, chosen, fitness, total

    def mutate(self, chromosome, patches, half, key):
        """Mutate a chromosome in place; return the gain."""
        return mutate_by_patches(key_of(key), patches, larger_halves(half), self.planes,
                                 self.colours, self.weights, chromosome[:3])


@settings(max_examples=20)
@given(st.integers(1, 9), st.integers(1, 12), st.sampled_from([(0, 1), (90, 120), (0, 256)]))
def test_weights_are_whole_parts_by_uniformity_and_none_leads_outside(rows, columns, colours):
    scene = Scene((rows, columns), colours=colours)
    weights, similar = inside(scene.weights), uniform_membership()
    np.testing.assert_array_equal(weights.sum(axis=0), WEIGHTS * ((rows, columns) != (1, 1)))
    for row, column in np.ndindex(rows, columns) if rows * columns > 1 else ():
        shares = np.zeros(8)
        for side, (down, right) in enumerate(reference.AROUND):
            if 0 <= row + down < rows and 0 <= column + right < columns:
                one, other = (inside(scene.colours)[:, place[0], place[1]].astype(int)
                              for place in ((row, column), (row + down, column + right)))
                shares[side] = similar[min(np.sum((one - other)**2) // 4, similar.size - 1)]
        apart = weights[:, row, column] - WEIGHTS * shares / shares.sum()
        heaviest = shares.argmax()
        assert ((apart > -1) & (apart <= 1e-4))[np.arange(8) != heaviest].all()
        assert -1e-4 <= apart[heaviest] < 8


@settings(max_examples=60)
@given(st.integers(1, 12), st.integers(1, 80), st.integers(0, LARGEST_HALF),
       st.integers(0, 10**6))
def test_mutation_gains_what_it_says_and_never_loses(rows, columns, half, seed):
    scene = Scene((rows, columns), seed)
    chromosome = scene.chromosome()
    gain = scene.mutate(chromosome, 50, half, seed)
    again = scene.chromosome(inside(chromosome[0]))
    assert again[3] - gain == chromosome[3] <= again[3]
    for found, expected in zip(chromosome[:3], again[:3]):
        np.testing.assert_array_equal(inside(found), inside(expected))
    assert chromosome[0].sum() == inside(chromosome[0]).sum()


@pytest.mark.parametrize('apart, together', [(UNIFORM, True), (UNIFORM + 1, False)])
def test_a_patch_holds_the_cells_that_are_uniform_with_its_middle(apart, together):
    """Of two walls of different colour a patch strikes one, although all cells would gain."""
    scene, mutated = Scene((1, 2)), set()
    inside(scene.colours)[:] = 100
    inside(scene.colours)[1, 0, 1] += apart
    inside(scene.planes)[:] = 10
    inside(scene.planes)[4] = 255
    for key in range(300):
        chromosome = scene.chromosome(np.zeros((1, 2)))
        scene.mutate(chromosome, 1, 2, key)
        mutated.add(tuple(inside(chromosome[0])[0].tolist()))
    assert ((4, 4) in mutated) == together
