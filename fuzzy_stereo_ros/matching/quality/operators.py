# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The operators of the profile `quality`: mutants that are planes of segments.

Each is called with the population and a source of random numbers and changes the chromosome in
both views, which takes the fitter parts of a mutant. A proposal needs evidence of the images
alone, since a smooth plane is fitter than a rough surface even where these have little evidence,
as in shadows on a road: a region moves only if its matches, without smoothness, are not less
possible. A small loss is allowed for each pixel on which the two views disagree.
"""
from fuzzy_stereo_ros.matching.quality.planes import planes_of, region_planes


def segment_planes(population, random):
    """Propose to each segment, coarse ones first, the plane fitted to it."""
    for number, view in enumerate(population.views):
        own = random.child(0, number)
        for scale, regions in reversed(list(enumerate(view.segments))):
            source = own.child(scale)
            planes = region_planes(
                view.pool, view.disparities, view.fitness.trusted, regions, source)
            view.propose(planes_of(planes, regions.labels), regions, source)
    population.measure()


def update_trust(population, random):
    """Trust matches where the views of the chromosome agree."""
    population.update_trust([view.disparities for view in population.views])


OPERATORS = {'segments': segment_planes, 'trust': update_trust}
