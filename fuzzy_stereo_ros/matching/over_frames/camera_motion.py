# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Motion of the camera between two frames, from corners followed by optical flow.

Not in the paper. Corners of the previous left image are followed into this one (Lucas and Kanade,
1981) at half size; the previous disparities make them points in space, in units of the baseline.
PnP with RANSAC (Fischler and Bolles, 1981) finds the pose that fits most of them, which is then
refined.
"""
from typing import NamedTuple

import cv2
from fuzzy_stereo_ros.matching.kernels.units import CONSISTENT
import numpy as np

CORNERS, CORNERS_APART = 200, 8  # corners at the most, and half-size pixels between two of them
QUALITY = 0.01              # least quality of a corner, relative to the best one
FLOW_WINDOW, FLOW_LEVELS = 11, 3        # px, pyramid levels
FLOW_ROUNDS, FLOW_STEP = 10, 0.03       # at most; px, smaller ones end it
FARTHEST = 1.0              # least px of disparity; farther corners hardly determine the shift
POSES_TRIED, INLIER, POSE_SURE = 100, 1.0, 0.999  # of RANSAC: poses, px of an inlier, probability
FEWEST_CORNERS, INLIER_SHARE = 20, 0.35  # corners that a pose needs, the least share of inliers
STANDS = 0.1                # px; median motion of corners below which the camera stands still
FOLLOWED, STOOD, FEW_CORNERS, UNCLEAR = (
    'followed', 'stands', 'too little texture', 'no motion explains the corners')


class CameraMotion(NamedTuple):
    """
    Projections of points from one frame to the other: P' = rotation P + shift, in baselines.

    forward, back: float64 (3, 4), of pixels: (column, row, 1, disparity) of a point becomes
    (column, row, 1) times a scale, by which its disparity falls
    """

    forward: np.ndarray
    back: np.ndarray

    def mirrored_right(self, columns, offset):
        """
        Return `forward` for pixels of the mirrored right image.

        columns: of the image; offset: cx of the left image minus that of the right one
        """
        mirror = np.eye(4)
        mirror[0] = -1, 0, columns - 1 + offset, 1
        whole = np.vstack([self.forward, (0, 0, 0, 1)])
        return (mirror @ whole @ np.linalg.inv(mirror))[:3]


def between(before, now, labels, validity, lowest, camera):
    """
    Return the `CameraMotion` between two frames, or None, and a description of the outcome.

    before, now: uint8 (r, c), left images at half size; labels, validity: float32 and uint8
    (r, c), disparities before, px less `lowest`, and which are CONSISTENT; camera: a `Camera` of
    the full image
    """
    lens = np.array([[camera.fx, 0, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1]])
    if camera.moved is not None:
        return _motion(*camera.moved, lens), FOLLOWED
    corners = cv2.goodFeaturesToTrack(before, CORNERS, QUALITY, CORNERS_APART)
    if corners is None or len(corners) < FEWEST_CORNERS:
        return None, FEW_CORNERS
    found, status, _ = cv2.calcOpticalFlowPyrLK(
        before, now, corners, None, winSize=(FLOW_WINDOW, FLOW_WINDOW), maxLevel=FLOW_LEVELS,
        criteria=(cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, FLOW_ROUNDS, FLOW_STEP))
    corners, found = corners.reshape(-1, 2), found.reshape(-1, 2)
    columns, rows = np.rint(corners).astype(np.intp).T
    disparities = labels[rows, columns] + np.float32(lowest)
    known = ((status.ravel() == 1) & (validity[rows, columns] == CONSISTENT)
             & (disparities > FARTHEST))
    if np.count_nonzero(known) < FEWEST_CORNERS:
        return None, FEW_CORNERS
    there, here = (2.0 * places[known].astype(np.float64) + 0.5 for places in (corners, found))
    if np.median(abs(here - there).max(axis=1)) < STANDS:
        return _motion(np.eye(3), np.zeros(3), lens), STOOD
    pose = _pose(there, here, camera.fx / disparities[known].astype(np.float64), lens)
    if pose is None:
        return None, UNCLEAR
    return _motion(cv2.Rodrigues(pose[0])[0], pose[1].ravel(), lens), FOLLOWED


def _pose(there, here, distances, lens):
    """Return the rotation vector and the shift from the previous frame to this one, or None."""
    rays = np.column_stack([there, np.ones(len(there))]) @ np.linalg.inv(lens).T
    points = rays * distances[:, None]
    try:
        # OpenCV's RANSAC has a fixed seed: equal corners give equal poses
        fitted, turn, move, inliers = cv2.solvePnPRansac(
            points, here, lens, None, iterationsCount=POSES_TRIED, reprojectionError=INLIER,
            confidence=POSE_SURE, flags=cv2.SOLVEPNP_P3P)
        fewest = max(FEWEST_CORNERS, INLIER_SHARE * len(there))
        if not fitted or inliers is None or len(inliers) < fewest:
            return None
        chosen = inliers.ravel()
        pose = cv2.solvePnPRefineLM(points[chosen], here[chosen], lens, None, turn, move)
    except cv2.error:       # degenerate corners or calibration
        return None
    return pose if all(np.isfinite(part).all() for part in pose) else None


def _motion(rotation, shift, lens):
    """Return the `CameraMotion` of a rotation and a shift."""
    def view(rotation, shift):
        return np.column_stack([lens @ rotation @ np.linalg.inv(lens), lens @ shift / lens[0, 0]])
    return CameraMotion(view(rotation, shift), view(rotation.T, -rotation.T @ shift))
