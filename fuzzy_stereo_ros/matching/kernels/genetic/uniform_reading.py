# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The uniform reading: the fitness of cells that are possible AND smooth, and its operators.

Of operators: what an exchange of genes changes, and mutation by patches of uniform cells. Maps
have a frame: row r and column c of the image are at [r + 1, c + 1], one row and one column lie
before them, one row and at least LANES + 1 columns behind. Frames hold zeros where it counts: no
possibility, no weight.
"""
from typing import NamedTuple

from fuzzy_stereo_ros.matching.kernels import simd
from fuzzy_stereo_ros.matching.kernels.compiled import called, inlined, kernel
from fuzzy_stereo_ros.matching.kernels.genetic.random_numbers import below, mixed, unit
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


@called
def write_fitness(genes, chosen, weights, columns, first, last, fitness):
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


fill_fitness = kernel(write_fitness)


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


class Chromosome(NamedTuple):
    """A framed map of genes, the possibility that each chose, and the fitness of each cell."""

    genes: np.ndarray    # uint16 (R + 2, W)
    chosen: np.ndarray   # uint8 (R + 2, W), 255ths
    fitness: np.ndarray  # uint16 (R + 2, W), 65280ths


class Patch(NamedTuple):
    """Rows top .. bottom - 1, columns left .. right - 1 of framed maps."""

    top: int
    bottom: int
    left: int
    right: int


@inlined
def _smooth(first, second):
    """Return the smoothness of two genes, without a branch."""
    step = first - second
    return EQUAL * np.int64(step == 0) + ONE_APART * np.int64(step * step == 1)


@inlined
def _at(array, place):
    """Return an element as int64; the place is uint64: no check for negative ones."""
    return np.int64(array[place])


@inlined
def _change_beside(genes, chosen, weights, cell, side, offset):
    """
    Return the loss of a cell and one neighbour if the cell takes its gene, and if both do.

    genes, chosen: pairs of flat framed maps, of both parents; weights: flat (8, plane)
    side: number of the neighbour; offset: of the neighbour
    """
    plane = genes[0].size
    other = np.uint64(cell + offset)
    here = np.uint64(cell)
    weight = _at(weights, np.uint64(side * plane + cell))
    back = _at(weights, np.uint64((side + 4 & 7) * plane + cell + offset))
    own, taken = _at(genes[0], here), _at(genes[1], here)
    beside, new = _at(genes[0], other), _at(genes[1], other)
    own_share, taken_share = _at(chosen[0], here) * weight, _at(chosen[1], here) * weight
    beside_share, new_share = _at(chosen[0], other) * back, _at(chosen[1], other) * back
    only_this = (taken_share + beside_share) * _smooth(taken, beside)
    change = (own_share + beside_share) * _smooth(own, beside) - only_this
    # 0 where the neighbour has the same gene in both parents
    together = (own_share + new_share) * _smooth(own, new) - (
        taken_share + new_share) * _smooth(taken, new) - change
    return change, together


@kernel
def fill_exchange(first, second, weights, changes):
    """
    Write the cost of taking the second parent's genes: fitness lost, 65280ths.

    Two neighbours share (a_p w_pq + a_q w_qp) * smoothness of their genes, a the possibility that
    each chose; the sum over all pairs of neighbours is the fitness.

    first, second: genes and chosen of each parent; changes: of framed maps
    """
    (genes_of_first, chosen_of_first), (genes_of_second, chosen_of_second) = first, second
    cells, alone, pairs = changes
    width = genes_of_first.shape[1]
    genes = genes_of_first.reshape(-1), genes_of_second.reshape(-1)
    chosen = chosen_of_first.reshape(-1), chosen_of_second.reshape(-1)
    flat_weights = weights.reshape(-1)
    for index in range(cells.size):
        cell = np.int64(cells[index])
        left, with_left = _change_beside(genes, chosen, flat_weights, cell, 0, -1)
        up_left, with_up_left = _change_beside(
            genes, chosen, flat_weights, cell, 1, -width - 1)
        up, with_up = _change_beside(genes, chosen, flat_weights, cell, 2, -width)
        up_right, with_up_right = _change_beside(
            genes, chosen, flat_weights, cell, 3, 1 - width)
        right, _ = _change_beside(genes, chosen, flat_weights, cell, 4, 1)
        down_right, _ = _change_beside(genes, chosen, flat_weights, cell, 5, width + 1)
        down, _ = _change_beside(genes, chosen, flat_weights, cell, 6, width)
        down_left, _ = _change_beside(genes, chosen, flat_weights, cell, 7, width - 1)
        alone[index] = (left + up_left + up + up_right
                        + right + down_right + down + down_left)
        pairs[index, 0], pairs[index, 1] = with_left, with_up_left
        pairs[index, 2], pairs[index, 3] = with_up, with_up_right


@kernel
def fill_fitness_around(cells, weights, chromosome):
    """Write the fitness of the rows around some cells of a chromosome whose genes changed."""
    genes, chosen, fitness = chromosome
    rows, columns = genes.shape[0] - 2, genes.shape[1] - FRAME
    first = last = 0        # rows of the image that are to be written
    for cell in cells:
        row = cell // genes.shape[1] - 1
        if row > last:
            write_fitness(genes, chosen, weights, columns, first, last, fitness)
            first = row - 1
        first, last = max(first, 0), min(row + 2, rows)
    write_fitness(genes, chosen, weights, columns, first, last, fitness)


LARGEST_HALF = 14               # a patch with its rim fits into the lanes of one block
SPARE_ROWS = 2 * LARGEST_HALF + 3
UNIFORM = 16                    # grey levels by which channels of uniform cells differ at most
NEAR_SHARE = 0.8                # of the patches take a gene from near, the others any
NEARLY = 20                     # 255ths that a patch's gene may be less possible at its middle


def larger_halves(largest):
    """
    Return from which draws on half the side of a patch is 2, 3 and so on up to the largest.

    Draws are uniform from 0 to 1: each order of magnitude is as likely as the next.

    largest: at most LARGEST_HALF; draws: float64
    """
    return np.log(np.arange(2, largest + 1)) / np.log(largest + 1)


@inlined
def _half_of_patch(bits, larger):
    """Return half the side of a patch, see `larger_halves`; some are one less."""
    draw, half = unit(bits), 1 - np.int64((bits & np.uint64(15)) < 5)
    for least in larger:
        half += np.int64(draw >= least)
    return half


@inlined
def _gene_of_patch(bits, any_gene, row, column, reach, genes, disparities):
    """Return any gene, or that of a cell near the middle, at random one more or less."""
    if any_gene:
        return np.int64(below(bits, np.uint64(disparities)))
    rows, columns = genes.shape[0] - 2, genes.shape[1] - FRAME
    side = np.uint64(2 * reach + 1)
    under = row - reach + np.int64(below(bits, side))
    beside = column - reach + np.int64(below(bits << np.uint64(24), side))
    gene = np.int64(genes[min(max(under, 1), rows), min(max(beside, 1), columns)])
    step = bits & np.uint64(7)
    gene += np.int64(step == 0) - np.int64(step == 1)
    return min(max(gene, 0), disparities - 1)


@inlined
def _place(patch_bits, half, rows, columns):
    """Return the middle of a patch, and its `Patch`, cut at the border of the image."""
    row = 1 + np.int64(below(patch_bits, np.uint64(rows)))
    column = 1 + np.int64(below(patch_bits << np.uint64(32), np.uint64(columns)))
    return row, column, Patch(max(row - half, 1), min(row + half, rows) + 1,
                              max(column - half, 1), min(column + half, columns) + 1)


@inlined
def _try(patch, middle, gene, features, chromosome, spare, width):
    """
    Write a gene where a patch is uniform with its middle; keep what was there in the spare.

    Returns a bit for each line that has changed. All maps are flat; features: possibility, colours
    """
    (possibility, colours), (genes, chosen, _), plane = features, chromosome, chromosome[0].size
    fresh, limit = simd.splat(np.uint16(gene)), simd.splat(np.uint8(UNIFORM))
    inside = simd.less(simd.lane_numbers(limit), simd.splat(np.uint8(patch.right - patch.left)))
    blue, green, red = (simd.splat(colours[middle]), simd.splat(colours[plane + middle]),
                        simd.splat(colours[2 * plane + middle]))
    within, changed = np.uint32((1 << (patch.right - patch.left)) - 1), np.uint32(0)
    for line in range(patch.top, patch.bottom):
        start, place = line * width + patch.left, simd.LANES * (line - patch.top)
        old = simd.load(genes, start)
        if ~simd.equal_bits(old, fresh) & within == 0:
            continue
        apart = simd.maximum(
            simd.maximum(
                simd.absolute_difference(blue, simd.load(colours, start)),
                simd.absolute_difference(green, simd.load(colours, plane + start))),
            simd.absolute_difference(red, simd.load(colours, 2 * plane + start)))
        uniform = simd.bit_and(inside, simd.at_most(apart, limit))
        new = simd.choose(simd.widen(uniform), fresh, old)
        if ~simd.equal_bits(new, old) == 0:
            continue
        changed |= np.uint32(1) << np.uint32(line - patch.top)
        old_chosen = simd.load(chosen, start)
        simd.store(spare.genes, place, old)
        simd.store(spare.chosen, place, old_chosen)
        simd.store(genes, start, new)
        simd.store(chosen, start, simd.choose(
            uniform, simd.load(possibility, gene * plane + start), old_chosen))
    return changed


@inlined
def _measure(patch, lines, weights, chromosome, spare, width):
    """Write the fitness of lines of a patch into the spare; return what is gained there."""
    genes, chosen, fitness = chromosome
    first, gain = max(patch.left - 1, 1), np.int64(0)
    while lines != 0:
        line = patch.top - 1 + simd.first_set(lines)
        lines &= lines - np.uint32(1)
        start = line * width + first
        block = fitness_of_block(genes, chosen, weights, start, width, genes.size)
        simd.store(spare.fitness, simd.LANES * (line - patch.top + 1), block)
        gain += simd.total(block) - simd.total(simd.load(fitness, start))
    return gain


@inlined
def _keep(patch, lines, chromosome, spare, width):
    """Take the fitness that was measured."""
    first = max(patch.left - 1, 1)
    while lines != 0:
        line = patch.top - 1 + simd.first_set(lines)
        lines &= lines - np.uint32(1)
        simd.store(chromosome[2], line * width + first,
                   simd.load(spare.fitness, simd.LANES * (line - patch.top + 1)))


@inlined
def _undo(patch, changed, chromosome, spare, width):
    """Write back what was there."""
    genes, chosen, _ = chromosome
    while changed != 0:
        line = patch.top + simd.first_set(changed)
        changed &= changed - np.uint32(1)
        start, place = line * width + patch.left, simd.LANES * (line - patch.top)
        simd.store(genes, start, simd.load(spare.genes, place))
        simd.store(chosen, start, simd.load(spare.chosen, place))


@kernel(allocates=True)
def mutate_by_patches(key, patches, larger, possibility, colours, weights, chromosome):
    """
    Try patches of one gene; each stays where the fitness does not fall. Return the gain.

    A patch is what is uniform with its middle in a square around it. A patch whose gene is
    clearly less possible at its middle than what is there is not tried. larger: float64, from
    `larger_halves`
    """
    genes, chosen, fitness = chromosome
    flat, size = (genes.reshape(-1), chosen.reshape(-1), fitness.reshape(-1)), (
        SPARE_ROWS * simd.LANES)
    spare = Chromosome(
        np.empty(size, np.uint16), np.empty(size, np.uint8), np.empty(size, np.uint16))
    rows, columns = genes.shape[0] - 2, genes.shape[1] - FRAME
    width, plane, disparities = genes.shape[1], genes.size, possibility.shape[0]
    features, flat_weights = (possibility.reshape(-1), colours.reshape(-1)), weights.reshape(-1)
    gained = np.int64(0)
    for number in range(patches):
        shape = mixed(key, np.uint64(3 * number + 1))
        half = _half_of_patch(shape, larger)
        row, column, patch = _place(mixed(key, np.uint64(3 * number)), half, rows, columns)
        gene = _gene_of_patch(mixed(key, np.uint64(3 * number + 2)),
                              unit(shape << np.uint64(12)) >= NEAR_SHARE, row, column, half + 2,
                              genes, disparities)
        middle = row * width + column
        if (np.int64(features[0][gene * plane + middle]) + NEARLY) * (
                WEIGHTS * EQUAL) < np.int64(flat[2][middle]):
            continue
        changed = _try(patch, middle, gene, features, flat, spare, width)
        if changed == 0:
            continue
        # the lines of the image, from top - 1 on, whose fitness changes
        around = changed | changed << np.uint32(1) | changed << np.uint32(2)
        around &= np.uint32((2 << (min(patch.bottom, rows) - patch.top + 1)) - 1
                            - (patch.top == 1))
        gain = _measure(patch, around, flat_weights, flat, spare, width)
        if gain < 0:
            _undo(patch, changed, flat, spare, width)
        else:
            _keep(patch, around, flat, spare, width)
            gained += gain
    return gained
