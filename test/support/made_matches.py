# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Small made pairs matched by a matcher of their own, and how matches compare."""
from dataclasses import replace

from fuzzy_stereo_ros.evaluation.scores import score
from fuzzy_stereo_ros.matching import StereoMatcher
from fuzzy_stereo_ros.synthetic.scenes import make_pair


def scene(rows=60, columns=100, seed=0, **options):
    """Return a noisy `ScenePair` of 24 disparities."""
    return make_pair(rows, columns, 24, seed, **{'noise': 2.0, **options})


def matched(pair, config, **changes):
    """Return the cold match of a pair; changes: of the configuration."""
    return StereoMatcher(replace(config, **changes)).match(pair.left, pair.right)


def bits(match):
    """Return all of a match that must not differ, for comparisons to the last bit."""
    return (match.disparity.tobytes(), match.confidence.tobytes(), match.warm, [
        (row.best_fitness, row.mean_fitness, row.diversity, row.gains) for row in match.history])


def wrong(match, pair):
    """Return the percent of the visible pixels that are off by more than one pixel."""
    return score(match.disparity, pair.truth, pair.visible).bad_dense[1.0]
