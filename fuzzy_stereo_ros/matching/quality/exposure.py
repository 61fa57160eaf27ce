# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The colours of the right image as the left camera would have exposed them.

Not in the paper, whose images have one exposure. The possibility of `quality` compares colours:
true matches become impossible if gain, offset, gamma or vignettes of the cameras differ. The
difference is estimated from matches of `realtime`, whose census does not depend on it.
"""
import cv2
import numpy as np

SURE_MATCH = 0.5    # confidence from which a match counts
PIXEL_STEP, SIDE = 4, 3  # px from one compared pixel to the next; side of the squares averaged
DARKEST, BRIGHTEST = 2, 250     # grey levels of a mean between which nothing is clipped
LEAST_CHANGE = 8.0  # mean change of grey levels; of one exposure, cameras differ by up to 6
FEWEST_MATCHES = 500  # matches that a fit needs
FIT_ROUNDS, OUTLIER = 6, 4.0  # of the fit; deviations from which a match does not count
SCALE = 255         # grey levels of a colour of 1


def exposed_alike(left, right, match):
    """Return right colours, uint8 (R, C, 3), as the left camera had exposed them, by a `Match`."""
    rows, columns = match.disparity.shape
    row, column = np.mgrid[PIXEL_STEP // 2:rows:PIXEL_STEP, PIXEL_STEP // 2:columns:PIXEL_STEP]
    sure = (match.confidence[row, column] > SURE_MATCH) & np.isfinite(match.disparity[row, column])
    row, column = row[sure], column[sure]
    seen = column - np.rint(match.disparity[row, column]).astype(np.int64)
    inside = (seen >= 0) & (seen < columns)
    row, column, seen = row[inside], column[inside], seen[inside]
    wanted, found = (cv2.blur(image, (SIDE, SIDE))[row, at] for image, at in (
        (left, column), (right, seen)))
    counts = ((np.minimum(wanted, found) >= DARKEST)
              & (np.maximum(wanted, found) <= BRIGHTEST)).all(axis=1)
    if np.count_nonzero(counts) < FEWEST_MATCHES:
        return right
    colour = (found[counts] / SCALE).ravel()
    across, down = (np.repeat(2 * place[counts] / side - 1, 3)
                    for place, side in ((seen, columns), (row, rows)))
    terms = np.column_stack([np.ones_like(colour), colour**2, colour[:, None] * np.column_stack(
        _shading(across, down))])
    offset, bend, *shading = _fit(terms, (wanted[counts] / SCALE).ravel())
    across, down = 2 * np.arange(columns) / columns - 1, 2 * np.arange(rows)[:, None] / rows - 1
    gain = sum(weight * term for weight, term in zip(shading, _shading(across, down)))
    colour = right / SCALE
    exposed = SCALE * (offset + colour * (gain[..., None] + bend * colour))
    if abs(exposed - right).mean() < LEAST_CHANGE:
        return right
    return np.clip(np.rint(exposed), 0, SCALE).astype(np.uint8)


def _shading(across, down):
    """Return the terms of a gain that lenses make differ over the image, from -1 to 1."""
    return np.ones_like(across), across, down, across**2 + down**2


def _fit(terms, wanted):
    """Return the weights of terms, float64 (N, T), by biweights: matches may be wrong."""
    trust = np.ones_like(wanted)
    for _ in range(FIT_ROUNDS):
        weighted = trust[:, None] * terms
        weights = np.linalg.lstsq(weighted.T @ terms, weighted.T @ wanted, rcond=None)[0]
        apart = abs(wanted - terms @ weights)
        limit = OUTLIER * 1.48 * np.median(apart) + 1 / SCALE
        trust = np.maximum(1 - (apart / limit)**2, 0)**2
    return weights
