# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Plain twin of a generation: the genes of tiles, and the choice among them."""
# Nothing is mirrored or packed: column c of an array is column c of the image.
from collections import Counter

import numpy as np
from reference_census import summed_passes, winner
from reference_refinement import INVALID

STEP = 2     # every so many cells of a row or column of a parent are looked at
INHERITED, MUTATES = 2, 4   # cells around a tile that must have a gene, for it to be changed, too


def inherited(parent, top, left, side):
    """Return how many cells have each label that a tile may inherit from a parent."""
    # parent: labels, validity or None, pixels a side of a cell, scale of labels, pixels that tiles
    # grow by (0: one cell is enough), and None or the choices of parts of the picture, with their
    # side, and the shift.
    labels, validity, cell, scale, grow, choices, part, shift = parent
    if choices is not None:
        found = Counter()
        for row in range(top, min(top + side, len(labels)), part):
            for column in range(left, min(left + side, labels.shape[1]), part):
                choice = int(choices[row // part, column // part])
                if choice >= 0:
                    found += inherited((*parent[:5], None, part, shift), row - choice * shift[0],
                                       column - choice * shift[1], part)
        return found
    rows, columns = (slice(max((start - grow) // cell, 0), max((start + side + grow) // cell, 0),
                           STEP)
                     for start in (top, left))
    found = labels[rows, columns]
    if validity is not None:
        found = found[validity[rows, columns] != INVALID]
    return Counter((scale * found.astype(int)).flat)


def tile_genes(parents, shape, disparities, last_parent, side, most, mutation=1):
    """Return {(tile row, tile column): its labels, ascending}, and the same of their origins."""
    # parents: (origin, what `inherited` takes); the origin of a label is the last parent that has
    # it, 0 where none has
    genes, origins = {}, {}
    for top in range(0, shape[0], side):
        for left in range(0, shape[1], side):
            cells = [(origin, parent[4] > 0, label, number) for origin, parent in parents
                     for label, number in inherited(parent, top, left, side).items()]
            known = {label: origin for origin, around, label, number in cells
                     if not around or number >= INHERITED}
            near = [label for label in known if last_parent <= label < disparities]
            nearest = dict.fromkeys(range(min(near, default=disparities), disparities), 1)
            common = nearest.keys() | {label for _, around, label, number in cells
                                       if not around or number >= MUTATES}
            known = nearest | known
            beside = known.keys() | {label + step for label in common
                                     for step in (-mutation, mutation)}
            tile = top // side, left // side
            genes[tile] = sorted(label for label in beside if 0 <= label < disparities)[:most]
            origins[tile] = [known.get(label, 0) for label in genes[tile]]
    return genes, origins


def selected(costs, genes, across, down, small, side):
    """Return labels, offsets, sums and margins of what is selected, (R, C) each."""
    # costs: int64 (R, C, D), priors included; genes: as of tile_genes; across, down: P2
    closed, maps = np.ones(costs.shape, bool), [
        np.zeros(costs.shape[:2], np.int64) for _ in range(4)]
    for (row, column), labels in genes.items():
        tile = np.s_[row * side:(row + 1) * side, column * side:(column + 1) * side]
        closed[tile][..., labels] = False
    sums = summed_passes(costs, closed, across, down, small)
    for row, column in np.ndindex(costs.shape[:2]):
        labels = genes[row // side, column // side]
        found, known = winner(sums[row, column, labels], labels), sums[row, column]
        beside = [near for near in (found[0] - 1, found[0] + 1) if near in labels]
        if any(known[near] == 255 for near in beside):      # at least 255: unknown
            found = found[0], 0, *found[2:]
        for values, value in zip(maps, found):
            values[row, column] = value
    return maps
