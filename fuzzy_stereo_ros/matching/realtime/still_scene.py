# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
A static scene is searched every n-th frame; the others reuse the result.

Not in the paper. Once nothing has changed for so long that noise is averaged away and planes have
evolved, another search finds what the last one found. A frame in which anything changed is
searched. What changes in one tile alone looks like noise and waits for the next search.
"""
from dataclasses import replace
from typing import NamedTuple

from fuzzy_stereo_ros.matching.kernels.temporal.change_detection import TILE
import numpy as np

SETTLED = 32    # frames without a change from which results are kept: as many are averaged
LONGEST_STEP_NS = 200_000_000   # slower cameras have each frame searched


class StillResult(NamedTuple):
    """
    The result of a scene that stands still, for the frames after it.

    still: frames in a row in which nothing changed; kept: frames since the last search;
    still_disparity, still_confidence: float32 (R, C), its result, empty until `still` is
    SETTLED
    """

    still: int
    kept: int
    still_disparity: np.ndarray
    still_confidence: np.ndarray


def kept_result(previous, views, config):
    """
    Return the `StillResult` that this frame keeps, None where it has to be searched.

    previous: the FrameState of the previous frame, or None; views: the `Tiles` of both views,
    compared with it; config: the MatcherConfig
    """
    result = previous and previous.own.result
    if (not result or result.kept + 1 >= config.still_interval
            or result.still < SETTLED or not _same_settings(previous.config, config)
            or _moves(views, previous.shape)):
        return None
    return result._replace(still=result.still + 1, kept=result.kept + 1)


def new_result(previous, views, match):
    """Return the `StillResult` of a frame that was searched; match: its `Match`."""
    moves = previous is None or _moves(views, match.disparity.shape)
    still = 0 if moves else previous.own.result.still + 1
    side = slice(None if still >= SETTLED else 0)
    return StillResult(
        still, 0, match.disparity[side, side].copy(), match.confidence[side, side].copy())


def _same_settings(one, other):
    """Return whether a result of one configuration may be kept for the other."""
    one, other = (replace(config, threads=0, deadline_ms=0.0) for config in (one, other))
    return one == other


def _moves(views, shape):
    """
    Return whether two tiles of a view, side by side or one above the other, have changed.

    views: the `Tiles` of each; shape: rows and columns of the images. A tile that is alone is
    enough.
    """
    # With less than half a tile inside, at the right and lower edge, noise looks like a change.
    rows, columns = (max((side + TILE // 2) // TILE, 1) for side in shape)
    for tiles in views:
        changed = tiles.choices[:rows, :columns] != 0
        if (changed.all() or (changed[1:] & changed[:-1]).any()
                or (changed[:, 1:] & changed[:, :-1]).any()):
            return True
    return False
