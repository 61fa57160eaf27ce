# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Kernels of the uniform reading: fitness, what an exchange of genes changes, mutation."""
from fuzzy_stereo_ros.matching.crossover import Cut, Exchange, PartitionCrossover
from fuzzy_stereo_ros.matching.kernels.genetic.exchange import differing_cells
from fuzzy_stereo_ros.matching.kernels.genetic.random_numbers import key_of
from fuzzy_stereo_ros.matching.kernels.genetic.uniform_reading import (
    fill_chosen, fill_exchange, fill_fitness, fill_fitness_around, fill_neighbour_weights, FRAME,
    larger_halves, LARGEST_HALF, mutate_by_patches, UNIFORM, WEIGHTS)
from fuzzy_stereo_ros.matching.paper.fitness import inside
from fuzzy_stereo_ros.matching.paper.possibility import uniform_membership
from hypothesis import given, settings, strategies as st
import numpy as np
import pytest
import reference
import reference_crossover

SHAPES = [(7, 11), (1, 9), (9, 1), (1, 1), (6, 70)]
DISPARITIES = 6


class Scene:
    """Random possibilities, colours and weights, framed, and chromosomes of them."""

    def __init__(self, shape, seed=0, colours=(90, 120)):
        """colours: lowest and highest."""
        self.random = np.random.default_rng(seed)
        self.shape, framed = shape, (shape[0] + 2, shape[1] + FRAME)
        self.planes = np.zeros((DISPARITIES, *framed), np.uint8)
        inside(self.planes)[:] = self.random.integers(0, 256, (DISPARITIES, *shape))
        self.colours = np.zeros((3, *framed), np.uint8)
        inside(self.colours)[:] = self.random.integers(*colours, (3, *shape))
        self.weights = np.zeros((8, *framed), np.uint8)
        fill_neighbour_weights(self.colours, uniform_membership(), 0, shape[0], self.weights)

    def chromosome(self, genes=None):
        """Return framed genes, chosen, fitness, and its sum."""
        framed = np.zeros(self.planes.shape[1:], np.uint16)
        inside(framed)[:] = self.random.integers(0, DISPARITIES, self.shape) \
            if genes is None else genes
        chosen, fitness = np.zeros(framed.shape, np.uint8), np.zeros(framed.shape, np.uint16)
        fill_chosen(self.planes, framed, 0, self.shape[0], chosen)
        total = fill_fitness(framed, chosen, self.weights, self.shape[1], 0, self.shape[0],
                             fitness)
        return framed, chosen, fitness, total


def exchanged(scene, first, second):
    """Return the Exchange of two chromosomes."""
    exchange = Exchange(*first[0].shape, 8)
    exchange.set_size(differing_cells(first[0], second[0], exchange.all_cells))
    fill_exchange(first[:2], second[:2], scene.weights, exchange.changes())
    return exchange


@pytest.mark.parametrize('shape', SHAPES[:3])
@pytest.mark.parametrize('colours', [(0, 1), (90, 120), (0, 256)])
def test_weights_are_whole_parts_by_uniformity_and_none_leads_outside(shape, colours):
    scene = Scene(shape, colours=colours)
    weights = inside(scene.weights)
    np.testing.assert_array_equal(weights.sum(axis=0), np.full(shape, WEIGHTS))
    similar = uniform_membership()
    for row, column in np.ndindex(shape):
        shares = []
        for down, right in reference.AROUND:
            if not (0 <= row + down < shape[0] and 0 <= column + right < shape[1]):
                shares.append(0.0)
                continue
            one, other = (inside(scene.colours)[:, place[0], place[1]].astype(int)
                          for place in ((row, column), (row + down, column + right)))
            distance = int(np.sum((one - other)**2)) // 4
            shares.append(float(similar[min(distance, similar.size - 1)]))
        exact = WEIGHTS * np.array(shares) / sum(shares)
        apart = weights[:, row, column] - exact
        heaviest = int(np.argmax(shares))
        assert np.all(np.delete(apart, heaviest) <= 1e-4)
        assert np.all(np.delete(apart, heaviest) > -1)
        assert -1e-4 <= apart[heaviest] < 8


@settings(max_examples=60, deadline=None)
@given(st.integers(1, 6), st.integers(1, 8), st.integers(0, 10**6), st.data())
def test_an_exchange_says_what_any_choice_of_cells_changes(rows, columns, seed, data):
    scene = Scene((rows, columns), seed)
    first, second = scene.chromosome(), scene.chromosome()
    exchange = exchanged(scene, first, second)
    taken = np.array(data.draw(st.lists(st.booleans(), min_size=exchange.cells.size,
                                        max_size=exchange.cells.size)), bool)
    child = first[0].copy()
    child.reshape(-1)[exchange.cells[taken]] = second[0].reshape(-1)[exchange.cells[taken]]
    change = first[3] - scene.chromosome(inside(child))[3]
    assert reference_crossover.change_of(exchange, taken) == change


@pytest.mark.parametrize('crossover', ['regions', 'cut'])
@pytest.mark.parametrize('shape', [(7, 11), (1, 9), (12, 40)])
def test_taking_genes_leaves_a_child_that_is_worth_what_the_crossover_said(shape, crossover):
    scene = Scene(shape, seed=3)
    first = scene.chromosome()
    genes = inside(first[0]).copy()
    genes[scene.random.random(shape) < 0.3] = 1
    second = scene.chromosome(genes)
    exchange = exchanged(scene, first, second)
    framed = first[0].shape
    change = (Cut(*framed, 8) if crossover == 'cut' else PartitionCrossover(*framed))(exchange)
    assert change <= 0
    exchange.take(first[0], second[0])
    exchange.take(first[1], second[1])
    fill_fitness_around(exchange.cells[exchange.taken], scene.weights, first[:3])
    again = scene.chromosome(inside(first[0]))
    for found, expected in zip(first[:3], again[:3]):
        np.testing.assert_array_equal(inside(found), inside(expected))
    assert again[3] == first[3] - change


def mutate(scene, chromosome, patches, half=3, key=1):
    """Mutate a chromosome in place; return the gain."""
    return mutate_by_patches(key_of(key), patches, larger_halves(half), scene.planes,
                             scene.colours, scene.weights, chromosome[:3])


@settings(max_examples=60, deadline=None)
@given(st.integers(1, 12), st.integers(1, 80), st.integers(0, LARGEST_HALF),
       st.integers(0, 10**6))
def test_mutation_gains_what_it_says_and_never_loses(rows, columns, half, seed):
    scene = Scene((rows, columns), seed)
    chromosome = scene.chromosome()
    before = chromosome[3]
    gain = mutate(scene, chromosome, 50, half, seed)
    assert gain >= 0
    again = scene.chromosome(inside(chromosome[0]))
    assert again[3] == before + gain
    for found, expected in zip(chromosome[:3], again[:3]):
        np.testing.assert_array_equal(inside(found), inside(expected))
    assert inside(chromosome[0]).max() < DISPARITIES
    for framed in (chromosome[0], scene.planes.max(axis=0)):
        outside = framed.copy()
        inside(outside)[:] = 0
        assert not outside.any()


@pytest.mark.parametrize('apart, together', [(UNIFORM, True), (UNIFORM + 1, False)])
def test_a_patch_holds_the_cells_that_are_uniform_with_its_middle(apart, together):
    """Of two walls of different colour a patch strikes one, although all cells would gain."""
    scene = Scene((1, 2))
    inside(scene.colours)[:] = 100
    inside(scene.colours)[1, 0, 1] += apart
    inside(scene.planes)[:] = 10
    inside(scene.planes)[4] = 255
    mutated = set()
    for key in range(300):
        chromosome = scene.chromosome(np.zeros((1, 2)))
        mutate(scene, chromosome, 1, half=2, key=key)
        mutated.add(tuple(inside(chromosome[0])[0].tolist()))
    assert ((4, 4) in mutated) == together
