# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The operators of the profile `quality`: mutants that are planes of regions.

Each is called with the population and a source of random numbers and changes the chromosome in
both views, which takes the fitter parts of a mutant. A proposal needs evidence of the images
alone, since a smooth plane is fitter than a rough surface even where these have little evidence,
as in shadows on a road: a region moves only if its matches, without smoothness, are not less
possible. A small loss is allowed for each pixel on which the two views disagree.
"""
from fuzzy_stereo_ros.matching.kernels.planes.costs import (
    Demands, RegionSets, reject_unfounded, UNIT)
from fuzzy_stereo_ros.matching.quality.planes import listed, planes_of, region_planes, tiles
import numpy as np

# The price is that of a pixel that the views disagree on.
DEMANDS = Demands(far=np.float32(0.5), price=int(0.2 * UNIT), least=100)
TILES = 40, 20       # px, sides of tiles that take the plane fitted to them


class Evidence:
    """Rejects regions that the images are evidence against, for one image size."""

    def __init__(self, rows, columns):
        """Allocate."""
        self._sets = RegionSets(np.zeros((rows, columns), np.int32), *(
            np.zeros(rows * columns + 1, kind) for kind in (np.int32, np.int64, np.int32)))

    def reject(self, labels, old, new, trusted, selected):
        """Set `selected` to false in regions that must not move: see reject_unfounded."""
        reject_unfounded(labels, old, new, trusted, tuple(DEMANDS), tuple(self._sets), selected)


def segment_planes(population, random):
    """Propose to each segment, coarse ones first, the plane fitted to it."""
    for number, view in enumerate(population.views):
        own = random.child(0, number)
        for scale, labels in reversed(list(enumerate(view.segments))):
            _propose_fitted(view, listed(*labels), own.child(scale))
    population.measure()


def tile_planes(population, random):
    """Propose to each tile the plane fitted to it."""
    for number, view in enumerate(population.views):
        for side in TILES:
            own = random.child(1, number, side)
            _propose_fitted(view, tiles(view.fitness.trusted.shape, side, own), own)
    population.measure()


def update_trust(population, random):
    """Trust matches where the views of the chromosome agree."""
    population.update_trust([view.disparities for view in population.views])
    population.measure()


OPERATORS = {'segments': segment_planes, 'tiles': tile_planes, 'trust': update_trust}
INHERITED = 'segments', 'trust'     # tiles lie elsewhere in each frame: maps would flicker


def _propose_fitted(view, regions, random):
    """Propose to each region the plane fitted to it."""
    planes = region_planes(view.pool, view.disparities, view.fitness.trusted, regions, random)
    view.propose(planes_of(planes, regions.labels), regions, random)
