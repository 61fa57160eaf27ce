# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The operators of the profile `quality`: mutants that are planes of regions, and crossover.

Each is called with the population and a source of random numbers and changes the chromosome whose
turn it is, in both views. A proposal needs evidence of the images alone, since a smooth plane is
fitter than a rough surface even where the images say little, as in shadows on a road: a region
moves only if its matches, without smoothness, are not less possible; each pixel about which the
two views disagree allows it a small loss.
"""
from fuzzy_stereo_ros.matching.kernels.planes import fits
from fuzzy_stereo_ros.matching.kernels.planes.costs import reject_unfounded, UNIT
from fuzzy_stereo_ros.matching.quality.planes import listed, region_planes, spread, tiles
import numpy as np

FAR = 0.5            # px from which a pixel counts as moved
PRICE = 0.2          # loss allowed by a pixel that the views disagree on, of an impossible match
LEAST = 100          # px of the smallest region that needs evidence
FITTED_TILES = 40, 20    # px, sides of tiles that take the plane fitted to them
COPIED_TILES = 30, 12    # px, sides of tiles that take the plane of one of their pixels


class Evidence:
    """Rejects regions that the images are evidence against, for one image size."""

    def __init__(self, rows, columns):
        """Allocate."""
        self._region = np.zeros((rows, columns), np.int32)
        self._parent, self._size = (np.zeros(rows * columns + 1, np.int32) for _ in range(2))
        self._excess = np.zeros(rows * columns + 1, np.int64)

    def reject(self, labels, old, new, old_costs, new_costs, trusted, selected):
        """Set `selected` to false in regions that must not move: see reject_unfounded."""
        reject_unfounded(labels, old, new, np.float32(FAR), old_costs, new_costs, trusted,
                         int(PRICE * UNIT), LEAST, self._region, self._parent, self._excess,
                         self._size, selected)


def segment_planes(population, random):
    """Propose to each segment, coarse ones first, the plane fitted to it."""
    for view, member, own in _turn(population, random, 0):
        for scale, labels in reversed(list(enumerate(view.segments))):
            regions = listed(*labels)
            planes = _fitted(view, member, regions, own.child(scale))
            _propose(view, member, planes, regions, own.child(scale))
    population.measure(population.current)


def tile_planes(population, random):
    """Propose to each tile the plane fitted to it."""
    for view, member, own in _turn(population, random, 1):
        for side in FITTED_TILES:
            drawn = own.child(side)
            regions = tiles(member.costs.shape, side, drawn)
            planes = _fitted(view, member, regions, drawn)
            _propose(view, member, planes, regions, drawn)
    population.measure(population.current)


def copied_planes(population, random):
    """Propose to each tile the plane of one of its pixels."""
    for view, member, own in _turn(population, random, 2):
        for side in COPIED_TILES:
            drawn = own.child(side)
            regions = tiles(member.costs.shape, side, drawn)
            chosen = np.zeros(regions.number, np.int32)
            fits.draw_pixels(regions.starts, regions.pixels, drawn.key, chosen)
            planes = member.planes.reshape(-1, 3)[np.maximum(chosen, 0)]
            _propose(view, member, planes, regions, drawn)
    population.measure(population.current)


def cross_siblings(population, random):
    """Cross the chromosome whose turn it was into the first one; end its turn."""
    if population.current > 0:
        for view in population.views:
            view.cross(view.members[0], view.members[population.current], random.child(3))
        population.measure(0)
        population.make_first(population.best)
    population.current = (population.current + 1) % len(population.fitness)


def update_trust(population, random):
    """Trust matches where the views of the first chromosome agree, once all had their turn."""
    if population.current == 0:
        population.update_trust([view.disparities(view.members[0]) for view in population.views])
        population.measure_all()


OPERATORS = {
    'segments': segment_planes,
    'tiles': tile_planes,
    'copies': copied_planes,
    'crossover': cross_siblings,
    'trust': update_trust,
}


def _turn(population, random, operator):
    """Yield each view, its map of the chromosome whose turn it is, and a random source."""
    for number, view in enumerate(population.views):
        yield (view, view.members[population.current],
               random.child(operator, number))


def _fitted(view, member, regions, random):
    """Return planes fitted to the regions of a member: float32 (number, 3)."""
    return region_planes(view.pool, view.disparities(member), view.fitness.trusted(), regions,
                         random)


def _propose(view, member, planes, regions, random):
    """Propose to each region of a member a plane of its own: float32 (number, 3)."""
    itself = np.arange(regions.number, dtype=np.int32)
    view.propose(member, spread(view.pool, planes, itself, regions), regions, random)
