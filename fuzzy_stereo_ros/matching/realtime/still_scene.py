# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
A static scene is searched every n-th frame; the others reuse the result.

Not in the paper. Once nothing has changed for SETTLED frames, noise is averaged away and planes
have evolved: another search would find the same map. A frame in which two neighbouring tiles
changed is searched. A change in a single tile looks like noise and waits for the next search.
"""
from dataclasses import replace

from fuzzy_stereo_ros.matching.kernels.temporal.change_detection import TILE

SETTLED = 32    # unchanged frames after which results are reused: as many are averaged
LONGEST_STEP_NS = 200_000_000   # slower cameras have each frame searched


def is_reused(previous, choices, config):
    """
    Return whether this frame reuses the result of an earlier one, and so is not searched.

    previous: the FrameState of the previous frame, or None; choices: of the tiles of both views,
    compared with it, see Averaging; config: the MatcherConfig
    """
    return (previous is not None and previous.own.since_search + 1 < config.still_interval
            and previous.own.still >= SETTLED and not _moves(choices, previous.shape)
            and config == replace(previous.config, threads=config.threads,
                                  deadline_ms=config.deadline_ms))


def new_result(previous, choices, config, match):
    """
    Return `still` to `still_confidence` of the `RealtimeState` of a frame that was searched.

    previous, choices, config: as above; match: its `Match`; a first frame, and each one where
    all are searched, counts as changed
    """
    changed = (previous is None or config.still_interval == 1
               or _moves(choices, match.disparity.shape))
    still = 0 if changed else previous.own.still + 1
    side = slice(None if still >= SETTLED else 0)
    return still, 0, match.disparity[side, side].copy(), match.confidence[side, side].copy()


def _moves(choices, shape):
    """
    Return whether two tiles of a view, side by side or one above the other, have changed.

    choices: of both views; shape: rows and columns of images. Where a view has one tile only, its
    change is enough; less than half a tile counts as changed.
    """
    # With less than half a tile inside, at the right and lower edge, noise looks like a change.
    rows, columns = ((side + TILE // 2) // TILE for side in shape)
    changed = choices[:, :rows, :columns] != 0
    return bool(changed.all(axis=(1, 2)).any() or (changed[:, 1:] & changed[:, :-1]).any()
                or (changed[:, :, 1:] & changed[:, :, :-1]).any())
