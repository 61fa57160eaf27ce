# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
A static scene is searched every n-th frame; the others reuse the result.

Not in the paper. Once nothing has changed for SETTLED frames, noise is averaged away and planes
have evolved: another search would find the same map. A frame in which two neighbouring tiles
changed is searched. A change in a single tile looks like noise and waits for the next search.
"""
from dataclasses import replace
from typing import NamedTuple

from fuzzy_stereo_ros.matching.kernels.temporal.change_detection import TILE
import numpy as np

SETTLED = 32    # unchanged frames after which results are reused: as many are averaged
LONGEST_STEP_NS = 200_000_000   # slower cameras have each frame searched


class StillResult(NamedTuple):
    """
    The result of a static scene, for the frames after it.

    still: searched frames in a row in which nothing changed; since_search: frames since the last
    search; still_disparity, still_confidence: float32 (R, C), its result, empty until `still` is
    SETTLED
    """

    still: int
    since_search: int
    still_disparity: np.ndarray
    still_confidence: np.ndarray


def reused_result(previous, views, config):
    """
    Return the `StillResult` that this frame reuses, None where it has to be searched.

    previous: the FrameState of the previous frame, or None; views: the `ViewTiles` of both views,
    compared with it; config: the MatcherConfig
    """
    result = previous and previous.own.result
    if (not result or result.since_search + 1 >= config.still_interval
            or result.still < SETTLED or _moves(views, previous.shape)
            or config != replace(previous.config, threads=config.threads,
                                 deadline_ms=config.deadline_ms)):
        return None
    return result._replace(since_search=result.since_search + 1)


def new_result(previous, views, config, match):
    """
    Return the `StillResult` of a frame that was searched; match: its `Match`.

    previous, views, config: as above; in a first frame all tiles count as changed
    """
    moves = previous is None or _moves(views, match.disparity.shape)
    still = 0 if moves else previous.own.result.still + 1
    side = slice(None if still >= SETTLED and config.still_interval > 1 else 0)
    return StillResult(
        still, 0, match.disparity[side, side].copy(), match.confidence[side, side].copy())


def _moves(views, shape):
    """
    Return whether two tiles of a view, side by side or one above the other, have changed.

    views: the `ViewTiles` of each; shape: rows and columns of images. Where a view has one tile
    only, its change is enough; less than half a tile counts as changed.
    """
    # With less than half a tile inside, at the right and lower edge, noise looks like a change.
    rows, columns = ((side + TILE // 2) // TILE for side in shape)
    for tiles in views:
        changed = tiles.choices[:rows, :columns] != 0
        if (np.count_nonzero(changed) == changed.size
                or np.count_nonzero(changed[1:] & changed[:-1])
                or np.count_nonzero(changed[:, 1:] & changed[:, :-1])):
            return True
    return False
