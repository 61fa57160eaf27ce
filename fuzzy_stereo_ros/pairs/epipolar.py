# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Measure whether the rows of rectified pairs are aligned, to detect a calibration that drifts.

In a rectified pair a point lies in the same row of both images. At corners with a confident
disparity, optical flow measures the offset between the two rows to a few hundredths of a pixel. A
plane is fitted to the offsets of many pairs: its value in the middle is the tilt, its slopes are
roll and zoom.
"""
from collections import deque
import time
from typing import NamedTuple

import cv2
import numpy as np

LIMIT = 0.5         # px of misalignment; more impairs matching
SURE = 2.0          # standard deviations by which a misalignment must exceed the limit
SHARE = 0.008       # of the matching time that may be spent on measuring
CORNERS = 300       # at most in a pair; the more confident half is measured
QUALITY = 0.001     # least quality of a corner, relative to the best one
DISTANCE = 16       # px, least distance of two corners
WINDOW = 15         # px, side of the window of the optical flow, and of the mean subtracted before
CONTRAST = 30.0     # grey levels, mean absolute deviation after normalisation
ROW_ERROR = 1.0     # px, largest distance along the row from the position of the disparity
RETURN_ERROR = 0.1  # px, largest distance from the corner after the flow there and back
LARGEST = 8.0       # px, largest row offset; larger ones are outliers
TILES = 6, 8        # rows and columns of tiles; the errors within a tile are correlated
FEWEST = 20, 6      # corners and tiles needed for a result
PAIRS = 32          # newest pairs that are evaluated
PAIRS_OF_SWING = 8  # needed for the changes from pair to pair
WARM_UP = 200       # px, side of the images of the warm-up
TUKEY = 4.685       # width of the biweight in standard deviations
PERCENTILE_WIDTH = 2.563    # standard deviations between the 10th and the 90th percentile


class Misalignment(NamedTuple):
    """
    The offset between the rows of a rectified pair, px; positive: the right image is lower.

    median: of all corners. offset: in the middle of the image. roll: additional offset at the
    right edge, its negative at the left edge. zoom: additional offset at the lower edge, its
    negative at the upper edge. doubts: standard deviations of offset, roll and zoom.
    swing: standard deviation of the offset between pairs; None for too few pairs.
    corners, pairs: their numbers. rows, columns: size of the images.
    """

    median: float
    offset: float
    roll: float
    zoom: float
    doubts: tuple
    swing: float | None
    corners: int
    pairs: int
    rows: int
    columns: int

    @property
    def roll_degrees(self):
        """The clockwise rotation of the right camera about its optical axis."""
        return float(np.rad2deg(self.roll / (self.columns / 2)))

    @property
    def zoom_percent(self):
        """The percentage by which the right image is larger."""
        return 100 * self.zoom / (self.rows / 2)

    @property
    def faults(self):
        """The list of 'tilt', 'roll', 'zoom' and 'timing' that certainly exceed the limit."""
        return [name for name, value, doubt in zip(
            ('tilt', 'roll', 'zoom', 'timing'), (*self[1:4], self.swing or 0), (*self.doubts, 0))
            if abs(value) - SURE * doubt > LIMIT]

    @property
    def advice(self):
        """A sentence that says what is wrong and what to do; '' without faults."""
        words = {
            'tilt': f'the right image is {abs(self.offset):.2f} px too '
                    f'{"low" if self.offset > 0 else "high"} (one camera is tilted, or rows are '
                    'cut off)',
            'roll': f'the right camera is turned by {self.roll_degrees:+.2f} degrees about its '
                    f'optical axis ({abs(self.roll):.2f} px at the left and right edges)',
            'zoom': f'the right image is {self.zoom_percent:+.2f} % larger '
                    f'({abs(self.zoom):.2f} px at the upper and lower edges)',
            'timing': f'the offset swings by {self.swing or 0:.2f} px from pair to pair (the '
                      'cameras do not expose at one moment, or move against each other)'}
        faults = self.faults
        if not faults:
            return ''
        remedy = 'synchronise the exposures: ' if faults == ['timing'] else 'recalibrate: '
        return remedy + '; '.join(words[fault] for fault in faults)

    @property
    def figures(self):
        """The figures with their standard deviations, for diagnostics: {name: text}."""
        return {**{what: f'{value:+.2f} +- {doubt:.2f} px' for what, value, doubt in zip(
                    ('row offset', 'row offset by roll', 'row offset by zoom'), self[1:4],
                    self.doubts)},
                'row offset, swing': 'unknown' if self.swing is None else f'{self.swing:.2f} px',
                'row offset, measured': f'{self.corners} corners of {self.pairs} pairs'}

    @property
    def sentence(self):
        """A sentence with the figures and the advice."""
        parts = (f'{name} {value:+.2f} +- {doubt:.2f}' for name, value, doubt in zip(
            ('in the middle', 'by roll at the edges', 'by zoom at the edges'), self[1:4],
            self.doubts))
        return (f"the right image's rows are lower by {', '.join(parts)} px; "
                + (self.advice or 'they fit'))

    @property
    def record(self):
        """The figures as numbers, for JSON."""
        return {**self._asdict(), 'roll_degrees': self.roll_degrees,
                'zoom_percent': self.zoom_percent, 'faults': self.faults, 'advice': self.advice,
                'sentence': self.sentence}


class EpipolarCheck:
    """
    Measures the misalignment of pairs.

    misalignment: the Misalignment of the newest pairs, None while there are too few corners.
    """

    def __init__(self):
        """Start without pairs."""
        self._credit, self._calibration = 0.0, None
        self.reset()

    def reset(self):
        """Forget all pairs."""
        self.misalignment, self._size, self._pairs = None, None, deque(maxlen=PAIRS)

    def warm_up(self):
        """Measure noise once, as OpenCV and NumPy load parts of themselves at the first call."""
        noise = np.random.default_rng(0).integers(0, 255, (WARM_UP, WARM_UP), np.uint8)
        self.measure(noise, noise, np.zeros(noise.shape, np.float32),
                     np.ones(noise.shape, np.float32))
        self.reset()

    def measure_within_share(self, pair, match, reference='left'):
        """
        Measure a StereoPair and its Match, unless that would take too large a share of the time.

        Previous pairs are forgotten if they have another calibration.
        """
        self._credit += SHARE * match.times['total']
        if self._credit < 0:
            return
        if pair.calibration != self._calibration:
            self._calibration = pair.calibration
            self.reset()
        started = time.perf_counter()
        self.measure(pair.left, pair.right, match.disparity, match.confidence, reference)
        self._credit -= 1000 * (time.perf_counter() - started)

    def measure(self, left, right, disparity, confidence, reference='left'):
        """
        Measure a pair; previous pairs of another size are forgotten.

        left, right: uint8 or uint16, (R, C) or (R, C, 3) BGR. disparity, confidence: of a Match.
        """
        size = disparity.shape
        if size != self._size:
            self.reset()
            self._size = size
        found = corner_offsets(left, right, disparity, confidence, reference)
        if len(found):
            self._pairs.append(found)
            self.misalignment = misalignment_of(list(self._pairs), *size)


def corner_offsets(left, right, disparity, confidence, reference='left'):
    """
    Return the corners of a pair: float64 (N, 3), column and row in the right image, row offset.

    All in px. Arguments as for `EpipolarCheck.measure`.
    """
    rows, columns = disparity.shape
    none = np.empty((0, 3))
    if min(rows, columns) < 4 * WINDOW:
        return none
    left, right = _normalised(left), _normalised(right)
    image, other, sign = (left, right, -1) if reference == 'left' else (right, left, 1)
    corners = _confident_corners(image, confidence)
    shifts = sign * disparity[tuple(corners[:, ::-1].astype(int).T)]
    expected = corners + np.stack([shifts, np.zeros_like(shifts)], axis=1)
    inside = ((corners[:, 1] > WINDOW) & (corners[:, 1] < rows - WINDOW)
              & (expected[:, 0] > WINDOW) & (expected[:, 0] < columns - WINDOW))
    corners, expected = corners[inside], expected[inside]
    if not len(corners):
        return none
    options = {'winSize': (WINDOW, WINDOW), 'maxLevel': 0, 'flags': cv2.OPTFLOW_USE_INITIAL_FLOW,
               'criteria': (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 20, 0.01)}
    found, known, _ = cv2.calcOpticalFlowPyrLK(image, other, corners, expected.copy(), **options)
    back, known_back, _ = cv2.calcOpticalFlowPyrLK(other, image, found, corners.copy(), **options)
    offsets = -sign * (found - corners)[:, 1].astype(np.float64)
    good = ((known[:, 0] > 0) & (known_back[:, 0] > 0) & (np.abs(offsets) < LARGEST)
            & (np.abs(found - expected)[:, 0] < ROW_ERROR)
            & (np.abs(back - corners).max(axis=1) < RETURN_ERROR))
    return np.column_stack([found if reference == 'left' else corners, offsets])[good]


def misalignment_of(pairs, rows, columns):
    """
    Return the Misalignment of pairs of equal size, None for too few corners.

    pairs: list of float64 (N, 3) of `corner_offsets`.
    """
    column, row, offsets = np.concatenate(pairs).T
    x, y = 2 * column / (columns - 1) - 1, 2 * row / (rows - 1) - 1     # -1 to 1
    down, across = (np.clip(((position + 1) / 2 * count).astype(int), 0, count - 1)
                    for position, count in zip((y, x), TILES))
    tiles = down * TILES[1] + across
    count = len(np.unique(tiles))
    if len(offsets) < FEWEST[0] or count < FEWEST[1]:
        return None
    terms = np.stack([np.ones_like(x), x, y], axis=1)
    residuals = offsets - np.median(offsets)
    for _ in range(6):
        spread = max(1.4826 * float(np.median(np.abs(residuals))), 1e-3)
        weights = np.maximum(1 - (residuals / (TUKEY * spread)) ** 2, 0) ** 2
        inverse = np.linalg.pinv(terms.T @ (weights[:, None] * terms))
        plane = inverse @ (terms.T @ (weights * offsets))
        residuals = offsets - terms @ plane
    # The corners of a tile count as one observation, as their errors are correlated.
    scores = np.zeros((TILES[0] * TILES[1], 3))
    np.add.at(scores, tiles, (weights * residuals)[:, None] * terms)
    variances = np.diag(inverse @ (scores.T @ scores) @ inverse) * count / (count - 3)
    ends = np.cumsum([len(one) for one in pairs])[:-1]
    swing = None
    if len(pairs) >= PAIRS_OF_SWING:
        low, high = np.percentile(
            [np.median(one) for one in np.split(residuals, ends)], (10, 90))
        swing = float(high - low) / PERCENTILE_WIDTH
    return Misalignment(float(np.median(offsets)), *map(float, plane),
                        tuple(map(float, np.sqrt(variances))), swing, len(offsets), len(pairs),
                        rows, columns)


def _normalised(image):
    """Return a grey image without its local mean, at equal contrast, as gains differ: uint8."""
    grey = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY) if image.ndim == 3 else image
    mean = cv2.blur(grey, (WINDOW, WINDOW))
    gain = CONTRAST / max(cv2.mean(cv2.absdiff(grey, mean))[0], 1e-6)
    return cv2.addWeighted(grey, gain, mean, -gain, 128, dtype=cv2.CV_8U)


def _confident_corners(image, confidence):
    """Return the more confident half of an image's corners: float32 (N, 2), column, row."""
    rows, columns = (side // 2 * 2 for side in image.shape)
    half = cv2.resize(image[:rows, :columns], (columns // 2, rows // 2),
                      interpolation=cv2.INTER_AREA)
    found = cv2.goodFeaturesToTrack(
        half, CORNERS, QUALITY, DISTANCE / 2,
        mask=(confidence[:rows:2, :columns:2] > 0).astype(np.uint8))
    if found is None or not len(found):
        return np.empty((0, 2), np.float32)
    corners = 2 * found.reshape(-1, 2)
    confidences = confidence[tuple(corners[:, ::-1].astype(int).T)]
    return corners[confidences >= np.median(confidences)]
