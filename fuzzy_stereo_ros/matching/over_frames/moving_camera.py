# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Motion of the camera between two frames, and what the previous one leaves, warped to the new pose.

Not in the paper. Corners of the previous left image are followed into this one (Lucas and Kanade,
1981) at half size; the previous disparities make them points in space, in units of the baseline.
PnP with RANSAC (Fischler and Bolles, 1981) finds the pose that fits most of them, which is then
refined. The best chromosome and the pictures of the previous frame are moved by it.
"""
from typing import NamedTuple

import cv2
from fuzzy_stereo_ros.matching.bands import cut_bands
from fuzzy_stereo_ros.matching.kernels.temporal import warp
from fuzzy_stereo_ros.matching.kernels.temporal.change_detection import TILE
from fuzzy_stereo_ros.matching.kernels.units import CONSISTENT
from fuzzy_stereo_ros.matching.over_frames.averaging import ANOTHER, History, STILL
from fuzzy_stereo_ros.matching.over_frames.state import CameraState, NO_CAMERA
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
HOLE = 5             # side of the median that closes holes between cells that moved
IN_PLACE = 'in place'


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


class MovingCamera:
    """
    The previous frame moved to this one, of one image size.

    known: whether a camera is given; description: how it moved, '' where it is not known; motion:
    the `CameraMotion`, None where the camera was not followed; lowest: px, the disparity of label
    0; offset: px, of the principal points; moved: float32 (r, c), labels of cells, and source:
    int32 (r, c), where they were, see warp.move_labels; bands: of rows of cells
    """

    def __init__(self, rows, columns, min_disparity):
        """Allocate for images of a size."""
        cells = rows // 2, columns // 2
        self._shape, self.bands = (rows, columns), cut_bands(cells[0])
        self.moved, self._right = (np.zeros(cells, np.float32) for _ in range(2))
        self.source = np.zeros(cells, np.int32)
        self._places = np.zeros((2, *cells), np.float32)
        self._shift, self._min_disparity = min(min_disparity, 0), min_disparity
        self.description, self.motion = '', None

    def follow(self, pool, previous, camera, half_grey, share):
        """
        Move the map of a previous FrameState, None for none; return whether that was done.

        camera: a `Camera`, or None; half_grey: uint8 (r, c), the left image at half size; share:
        of its tiles that are unchanged: where most are, nothing has to be moved
        """
        self.known, self.motion, self.description = camera is not None, None, ''
        self._pool, self._half_grey = pool, half_grey
        if camera is None or previous is None or not previous.camera.half_grey.size:
            return False
        if share >= STILL:
            self.description = IN_PLACE
            return False
        self.lowest, self.offset = self._min_disparity - camera.offset, camera.offset
        before = previous.camera
        self.motion, self.description = between(
            before.half_grey, half_grey, before.cells, before.cell_validity, self.lowest, camera)
        if self.motion is not None:
            between_cells = to_pixels(self.motion.forward) * [[0.5], [0.5], [1.0]]
            warp.move_labels(before.cells, self.kernel_motion(between_cells),
                             (self.moved, self.source))
        return self.motion is not None

    def average_warped(self, averaging, views, noises, noisy, previous, sides=()):
        """
        Average views with the pictures of a FrameState, warped, where nothing better was found.

        That is where noise is high and the `Averaging` found no unchanged tiles. noises: the
        `NoiseEstimate` of each view; noisy: whether it is high, before averaging; sides: of the
        state's colours, of the left or the mirrored right view, 0 or 1. Returns the warped
        colours, None where nothing was averaged.
        """
        if self.motion is None or not noisy or averaging.share >= ANOTHER:
            return None
        pictures, ages, colours = self._warped(previous, sides)
        for view, noise in zip(views, noises):
            noise.measure(view, 0, view.rows)
        averaging.average(self._pool, views, noises, History(
            pictures, ages, np.zeros_like(previous.drifts), None), search=False)
        return colours

    def _warped(self, previous, sides):
        """Return the pictures, ages and colours of a FrameState, warped to this frame."""
        closed = np.where(self.moved < 0, cv2.medianBlur(self.moved, HOLE), self.moved)
        back = self.kernel_motion(_of_centres(self.motion.back))
        warp.to_right(closed, self._shift, self._right)
        pictures = np.empty_like(previous.pictures)
        ages, colours = np.empty_like(previous.ages), np.empty_like(previous.colours)
        for side, labels in enumerate((closed, self._right)):
            self._pool.each(lambda band, labels=labels, side=side: warp.look_back(
                labels, back, self._shift, bool(side), self._places, *band[1:]), self.bands)
            across, down = map(self._full_size, self._places)
            if side:        # mirrored, as the picture is
                across, down = (np.ascontiguousarray(found[:, ::-1]) for found in (
                    self._shape[1] - 1 - across, down))
            for before, after, of in ((previous.pictures[side], pictures[side], side),
                                      *zip(previous.colours, colours, sides)):
                if of == side:
                    cv2.remap(before, across, down, cv2.INTER_LINEAR, dst=after,
                              borderMode=cv2.BORDER_CONSTANT)
            ages[side] = _ages_at(previous.ages[side], across, down)
        return pictures, ages, colours

    def state(self, cells, validity):
        """
        Return the `CameraState` of this frame; NO_CAMERA where no camera is known.

        cells: float32 (r, c), labels of this frame; validity: uint8 (R, C), 0 = consistent
        """
        if not self.known:
            return NO_CAMERA
        rows, columns = cells.shape
        return CameraState(self._half_grey.copy(), cells,
                           validity[:2 * rows:2, :2 * columns:2].copy())

    def kernel_motion(self, matrix):
        """Return the motion by a matrix (3, 4), as kernels take it, see warp.py."""
        return tuple(matrix.ravel().tolist()), self.lowest

    def _full_size(self, cells):
        """Return values of the cells' centres for all pixels, linear between them."""
        found = cv2.resize(cells, (2 * cells.shape[1], 2 * cells.shape[0]))
        rows, columns = self._shape
        return np.pad(found, ((0, rows - found.shape[0]), (0, columns - found.shape[1])),
                      constant_values=warp.OUTSIDE_IMAGE)


def to_pixels(matrix):
    """Return a matrix of pixels as one from cells to pixels."""
    return matrix * (2.0, 2.0, 1.0, 1.0)


def _of_centres(matrix):
    """Return a matrix of pixels as one from the centres of cells to pixels."""
    centred = to_pixels(matrix)
    centred[:, 2] += 0.5 * (matrix[:, 0] + matrix[:, 1])
    return centred


def _ages_at(ages, across, down):
    """Return the ages of tiles, float32 (tile rows, tile columns), where their middles were."""
    rows, columns = (np.minimum(np.arange(number) * TILE + TILE // 2, size - 1)
                     for number, size in zip(ages.shape, across.shape))
    row, column = (np.floor_divide(found[np.ix_(rows, columns)], TILE).astype(np.intp)
                   for found in (down, across))
    inside = (row >= 0) & (row < ages.shape[0]) & (column >= 0) & (column < ages.shape[1])
    return np.where(inside, ages[np.clip(row, 0, ages.shape[0] - 1),
                                 np.clip(column, 0, ages.shape[1] - 1)], 0).astype(np.float32)
