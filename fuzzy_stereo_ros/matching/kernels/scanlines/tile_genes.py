# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The genes of each tile: what its cells, and those around them, inherit, mutated by one.

Not in the paper, whose cells draw their genes from all labels. A tile is a square of 32 x 32
pixels. Its cells may exchange their parents' genes, so all of these are candidates of every cell.
Genes of the cells around it, as they were found, are noise where they are rare: they are counted.
"""
from typing import NamedTuple

from fuzzy_stereo_ros.matching.kernels.addresses import (
    load_byte, load_short, store_byte, store_long, store_short)
from fuzzy_stereo_ros.matching.kernels.compiled import called, inlined, kernel
from fuzzy_stereo_ros.matching.kernels.simd import (
    bit_or, equal_bits, first_set, LANES, load, maximum, prefetch, saturating_subtract, splat,
    store)
from fuzzy_stereo_ros.matching.kernels.units import INVALID
import numpy as np

SIDE = LANES         # pixels of a tile
# Rows of a tile lie apart in memory, where a processor does not expect them: they are asked for.
AHEAD = 3            # rows that this is done ahead
STEP = 2             # every so many cells of a row or column of a parent are looked at
MOST_GENES = 254     # of a tile; the largest disparities are dropped
MUTATED, HALF_SIZE, PREVIOUS = range(3)     # where a gene is from; the last one counts
INHERITED, MUTATES = 2, 4   # cells in and around a tile from which a gene counts; is changed, too
MOST_CELLS = 253    # that are counted; the genes of other parents are marked by more


class Parent(NamedTuple):
    """A map that tiles inherit from; labels and validity are addresses."""

    labels: int
    label_bytes: int         # 1 or 2
    validity: int            # uint8, labels where it is INVALID are not inherited; 0: all are
    rows: int
    columns: int
    cell: int                # pixels of the image a side of one of its cells: 1 or 2
    scale: int               # how many labels at full size one of its labels is: 1 or 2
    grow: int                # pixels around a tile whose genes are counted; 0: all are inherited
    choices: int             # int8 of parts of it: 0 stayed in place, 1 moved, -1 is new; 0: all
    part: int                # pixels of a side of such a part, which divides SIDE
    down: int                # pixels by which the picture has moved since
    right: int


class Tiles(NamedTuple):
    """The genes of the tiles of an image; all but numbers are addresses."""

    rows: int                # of tiles
    columns: int
    mutation: int            # by how much genes are changed, too: 0 or 1
    stride: int              # genes from a tile's to those of the next; 0: all have the same
    genes: int               # uint16 (tiles, MOST_GENES), labels, ascending
    origins: int             # uint8, alike, MUTATED, HALF_SIZE or PREVIOUS; 0: nobody asks
    counts: int              # int64 (tiles,)
    places: int              # int64 (tiles + 1,), bytes of the tiles before, see stride_of


@inlined
def stride_of(count):
    """Return the bytes from a line of a tile with so many genes to the next."""
    return (count | 1) * LANES      # lines that are a power of two apart evict each other


@called
def _inherit(parent, origin, top, left, side, seen, nowhere):
    """
    Mark the labels of a parent in a square at seen + label by their origin, or count their cells.

    parent: the fields of a Parent; top, left, side: of the square, in the parent's picture;
    nowhere: the place of labels that are not inherited
    """
    mark, parent = np.uint8(MOST_CELLS + origin), Parent(*parent)
    cell, grow = parent.cell, parent.grow
    begin, end = max((left - grow) // cell, 0), min((left + side + grow) // cell, parent.columns)
    for row in range(max((top - grow) // cell, 0), min((top + side + grow) // cell, parent.rows),
                     STEP):
        at = row * parent.columns
        ahead = (row + AHEAD * STEP) * parent.columns + begin
        prefetch(parent.labels + ahead * parent.label_bytes)
        if parent.validity != 0:
            prefetch(parent.validity + ahead)
        for column in range(begin, end, STEP):
            label = (np.int64(load_byte(parent.labels, at + column)) if parent.label_bytes == 1
                     else np.int64(load_short(parent.labels, at + column)))
            valid = (parent.validity == 0
                     or load_byte(parent.validity, at + column) != INVALID)
            place = parent.scale * label if valid else nowhere
            store_byte(seen, place, np.uint8(
                min(load_byte(seen, place) + 1, MOST_CELLS) if grow else mark))


@inlined
def _inherit_parts(parent, origin, top, left, seen, nowhere):
    """Mark the labels of a parent in a tile, as far as its parts are not new, see `_inherit`."""
    known = Parent(*parent)
    if known.choices == 0:
        _inherit(parent, origin, top, left, SIDE, seen, nowhere)
        return
    part, across = known.part, -(-known.columns // known.part)
    for row in range(top, min(top + SIDE, known.rows), part):
        for column in range(left, min(left + SIDE, known.columns), part):
            choice = np.int64(load_byte(known.choices, row // part * across + column // part))
            if choice <= 1:
                _inherit(parent, origin, row - choice * known.down,
                         column - choice * known.right, part, seen, nowhere)


@inlined
def _mutate(seen, disparities, by, genes, origins):
    """
    Write the labels that are seen, and those `by` beside common ones, ascending, and their origin.

    Returns how many there are.
    """
    count, none = 0, splat(np.uint8(0))
    few, rare = splat(np.uint8(INHERITED - 1)), splat(np.uint8(MUTATES - 1))
    for first in range(0, disparities, LANES):
        bits = ~equal_bits(none, bit_or(
            saturating_subtract(load(seen, first), few), saturating_subtract(
                maximum(load(seen, first - by), load(seen, first + by)), rare)))
        while bits != 0:
            label = first + first_set(bits)
            bits &= bits - np.uint32(1)
            if label < disparities and count < MOST_GENES:
                store_short(genes, count, label)
                cells = load_byte(seen, label)
                store_byte(origins, count, np.uint8(
                    cells - MOST_CELLS if cells > MOST_CELLS
                    else MUTATED if cells < INHERITED else HALF_SIZE))
                count += 1
    return count


@called
def seen_size(disparities):
    """Return how many bytes `seen` of list_genes has."""
    return 5 * LANES + disparities // LANES * LANES


@kernel
def list_genes(smooth, found, previous, tiles, seen, disparities, last_parent, first, last):
    """
    List the genes of the tiles of the rows of tiles first .. last - 1.

    smooth, found, previous: the fields of Parents; tiles: those of Tiles, of which genes, origins
    and counts are written; seen: address of seen_size bytes; last_parent: the last label that a
    half-size map can have, which stands for nearer ones: all of these are genes
    """
    tiles, size = Tiles(*tiles), seen_size(disparities)
    memory, seen, nowhere = seen, seen + LANES, size - LANES - 1
    for tile in range(first * tiles.columns, last * tiles.columns):
        for place in range(0, size, LANES):
            store(memory, place, splat(np.uint8(0)))
        top, left = tile // tiles.columns * SIDE, tile % tiles.columns * SIDE
        for parent in (found, smooth):      # counts first: marks are written over them
            _inherit_parts(parent, HALF_SIZE, top, left, seen, nowhere)
        _inherit_parts(previous, PREVIOUS, top, left, seen, nowhere)
        beyond = False
        for label in range(last_parent, disparities):
            beyond |= load_byte(seen, label) >= INHERITED
            if beyond:
                store_byte(seen, label, np.uint8(
                    max(load_byte(seen, label), MOST_CELLS + HALF_SIZE)))
        store_long(tiles.counts, tile, _mutate(
            seen, disparities, tiles.mutation, tiles.genes + 2 * MOST_GENES * tile,
            tiles.origins + MOST_GENES * tile))
