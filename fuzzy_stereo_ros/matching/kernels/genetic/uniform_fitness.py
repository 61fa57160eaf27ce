# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The fitness of the uniform reading: cells that are possible AND smooth among their neighbours.

Maps have a frame: row r and column c of the image are at [r + 1, c + 1], one row and one column
lie before them, one row and at least LANES + 1 columns behind. Frames hold zeros where it counts:
no possibility, no weight.
"""
from fuzzy_stereo_ros.matching.kernels import simd
from fuzzy_stereo_ros.matching.kernels.compiled import inlined, kernel
import numpy as np

FRAME = simd.LANES + 2      # columns of a map that are none of the image
WEIGHTS = 32               # sum of the weights of the eight neighbours of a cell
EQUAL, ONE_APART = 8, 7     # smoothness of two genes that are equal or differ by one; else 0
# Neighbours in the order of the weights; the k-th and the (k + 4)-th are opposite.
NEIGHBOURS_DOWN = (0, -1, -1, -1, 0, 1, 1, 1)
NEIGHBOURS_ACROSS = (-1, -1, 0, 1, 1, 1, 0, -1)


@inlined
def _add_neighbour(sums, own, genes, weights, row_start, neighbour_start, plane_start):
    """Return sums of the weights of near and of equal neighbours, uint16, with one more's."""
    other = simd.load(genes, neighbour_start)
    weight = simd.widen(simd.load(weights, plane_start + row_start))
    one = simd.splat(np.uint16(1))
    step = simd.add(simd.subtract(other, own), one)     # 0, 1, 2 for steps of -1, 0, +1
    return (simd.add(sums[0], simd.bit_and(simd.at_most(step, simd.splat(np.uint16(2))), weight)),
            simd.add(sums[1], simd.bit_and(simd.equal(step, one), weight)))


@inlined
def fitness_of_block(genes, chosen, weights, start, width, plane):
    """
    Return the fitness of LANES cells of a row: possibility times smoothness, at most 65280.

    genes, chosen, weights: flat; start: index of the first cell; width: of a framed row; plane:
    cells of a framed map
    """
    own = simd.load(genes, start)
    sums = simd.splat(np.uint16(0)), simd.splat(np.uint16(0))
    sums = _add_neighbour(sums, own, genes, weights, start, start - 1, 0)
    sums = _add_neighbour(sums, own, genes, weights, start, start - width - 1, plane)
    sums = _add_neighbour(sums, own, genes, weights, start, start - width, 2 * plane)
    sums = _add_neighbour(sums, own, genes, weights, start, start - width + 1, 3 * plane)
    sums = _add_neighbour(sums, own, genes, weights, start, start + 1, 4 * plane)
    sums = _add_neighbour(sums, own, genes, weights, start, start + width + 1, 5 * plane)
    sums = _add_neighbour(sums, own, genes, weights, start, start + width, 6 * plane)
    sums = _add_neighbour(sums, own, genes, weights, start, start + width - 1, 7 * plane)
    near, same = sums       # near ones are the equal ones and those one apart
    smooth = simd.add(simd.multiply(near, simd.splat(np.uint16(ONE_APART))),
                      simd.multiply(same, simd.splat(np.uint16(EQUAL - ONE_APART))))
    return simd.multiply(smooth, simd.widen(simd.load(chosen, start)))


@kernel
def fill_fitness(genes, chosen, weights, columns, first, last, fitness):
    """Write the fitness of the cells of some rows of the image; return its sum."""
    width, plane = genes.shape[1], genes.size
    flat_genes, flat_chosen = genes.reshape(-1), chosen.reshape(-1)
    flat_weights, flat_fitness = weights.reshape(-1), fitness.reshape(-1)
    sum_of_rows = np.int64(0)
    for row in range(first + 1, last + 1):
        for start in range(row * width + 1, row * width + 1 + columns, simd.LANES):
            block = fitness_of_block(flat_genes, flat_chosen, flat_weights, start, width, plane)
            simd.store(flat_fitness, start, block)
            sum_of_rows += simd.total(block)
    return sum_of_rows


@kernel
def fill_chosen(possibility, genes, first, last, chosen):
    """Write how possible the match is that a chromosome chose in each cell of some rows."""
    for row in range(first + 1, last + 1):
        for column in range(genes.shape[1]):
            chosen[row, column] = possibility[genes[row, column], row, column]


@kernel(allocates=True)
def fill_neighbour_weights(colours, similar, first, last, weights):
    """
    Write how uniform each cell is with its eight neighbours, as whole parts of WEIGHTS.

    A neighbour weighs by its membership in the fuzzy class of the cell's colour; what rounding
    leaves over goes to the heaviest. Neighbours outside the image weigh nothing. similar: float32,
    by squared distance of colours / 4
    """
    rows, columns = weights.shape[1] - 2, weights.shape[2] - FRAME
    shares = np.zeros(8, np.float32)
    for row in range(first + 1, last + 1):
        for column in range(1, columns + 1):
            for k in range(8):
                near, beside = row + NEIGHBOURS_DOWN[k], column + NEIGHBOURS_ACROSS[k]
                shares[k] = 0.0
                if 1 <= near <= rows and 1 <= beside <= columns:
                    distance = 0
                    for channel in range(3):
                        step = np.int64(colours[channel, row, column]) - np.int64(
                            colours[channel, near, beside])
                        distance += step * step
                    shares[k] = similar[min(distance >> 2, similar.size - 1)]
            whole = shares.sum()
            if whole == 0.0:
                continue            # the only cell of an image
            left_over, heaviest = WEIGHTS, 0
            for k in range(8):
                part = np.int64(WEIGHTS * shares[k] / whole)
                weights[k, row, column] = part
                left_over -= part
                if shares[k] > shares[heaviest]:
                    heaviest = k
            weights[heaviest, row, column] += left_over
