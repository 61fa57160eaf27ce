# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Whether the rows of a rectified pair still fit each other, measured where the match is sure.

A point stands in one row of both images. At corners whose disparity is confident the offset
between the two rows is measured by optical flow, to a few hundredths of a pixel, and a plane is
fitted to the offsets of many pairs: its value in the middle, and what it gains towards the edges.
"""
from collections import deque
import time
from typing import NamedTuple

import cv2
import numpy as np

LIMIT = 0.5         # px; matching suffers from more
SURE = 2.0          # standard deviations by which an error must exceed the limit
SHARE = 0.008       # of the time of matching that is spent on watching
CORNERS = 300       # of a pair at most, the surer half of which is measured
QUALITY = 0.001     # of the best corner that another one must have
DISTANCE = 16       # px between two corners
WINDOW = 15         # px, of the optical flow, and of the mean that is taken off before
CONTRAST = 30.0     # grey levels, mean deviation of a flattened image
STRAYED = 1.0       # px in a row from the place that the disparity tells
RETURNED = 0.1      # px from the corner, when followed there and back
LARGEST = 8.0       # px; offsets beyond are mistakes
TILES = 6, 8        # rows, columns of tiles; the corners of one may all be wrong alike
FEWEST = 20, 6      # corners and tiles without which nothing is said
PAIRS = 32          # that are looked back on
PAIRS_OF_SWING = 8  # without which nothing is said about changes from pair to pair
WARM_UP = 200       # px, side of the images
TUKEY = 4.685       # of the biweight, in standard deviations
BETWEEN = 2.563     # standard deviations between the 10th and the 90th percentile


class Misalignment(NamedTuple):
    """
    By how many px the rows of the right image stand lower than those of the left one.

    median: of all corners. offset: in the middle of the image. roll: how much more at the right
    edge, and less at the left one. zoom: how much more at the lower edge, and less at the upper
    one. doubts: standard deviations of offset, roll and zoom, px.
    swing: standard deviation of a pair's offset from pair to pair, px; None of too few.
    corners, pairs: how many were measured. rows, columns: of the images.
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
        """By how much the right camera is turned clockwise about its optical axis."""
        return float(np.rad2deg(self.roll / (self.columns / 2)))

    @property
    def zoom_percent(self):
        """By how much the right image is larger."""
        return 100 * self.zoom / (self.rows / 2)

    @property
    def faults(self):
        """The kinds of error that are surely above the limit: of tilt, roll, zoom, timing."""
        return [name for name, value, doubt in zip(
            ('tilt', 'roll', 'zoom', 'timing'), (*self[1:4], self.swing or 0), (*self.doubts, 0))
            if abs(value) - SURE * doubt > LIMIT]

    @property
    def advice(self):
        """What is wrong and what to do, one sentence; '' where nothing is surely wrong."""
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
        """The figures as texts, {what: text}, each with its doubt."""
        return {**{what: f'{value:+.2f} +- {doubt:.2f} px' for what, value, doubt in zip(
                    ('row offset', 'row offset by roll', 'row offset by zoom'), self[1:4],
                    self.doubts)},
                'row offset, swing': 'unknown' if self.swing is None else f'{self.swing:.2f} px',
                'row offset, measured': f'{self.corners} corners of {self.pairs} pairs'}

    @property
    def sentence(self):
        """The figures and the advice as one sentence."""
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
    Measures pairs and says how misaligned the images are.

    misalignment: the Misalignment of the newest pairs, None while too few corners are known.
    """

    def __init__(self):
        """Begin with no pair."""
        self._credit, self._calibration = 0.0, None
        self.reset()

    def reset(self):
        """Forget the pairs so far, as after a calibration."""
        self.misalignment, self._size, self._pairs = None, None, deque(maxlen=PAIRS)

    def warm_up(self):
        """Let OpenCV and NumPy load what the first look needs, which takes longer than it."""
        noise = np.random.default_rng(0).integers(0, 255, (WARM_UP, WARM_UP), np.uint8)
        self.look(noise, noise, np.zeros(noise.shape, np.float32),
                  np.ones(noise.shape, np.float32))
        self.reset()

    def watch(self, pair, match, reference='left'):
        """
        Look at a StereoPair and its Match where the time spent so far allows it.

        Forgets the pairs before where the calibration is another one.
        """
        self._credit += SHARE * match.times['total']
        if self._credit < 0:
            return
        if pair.calibration != self._calibration:
            self._calibration = pair.calibration
            self.reset()
        started = time.perf_counter()
        self.look(pair.left, pair.right, match.disparity, match.confidence, reference)
        self._credit -= 1000 * (time.perf_counter() - started)

    def look(self, left, right, disparity, confidence, reference='left'):
        """
        Measure a pair; images of another size than before begin anew.

        left, right: uint8 or uint16, (R, C) or (R, C, 3) BGR. disparity, confidence: as of a
        Match, of the reference image.
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
    Return where the corners of a pair are in the right image, and by how much they are lower.

    Float64 (N, 3): column, row, offset, px. Arguments as of `EpipolarCheck.look`.
    """
    rows, columns = disparity.shape
    none = np.empty((0, 3))
    if min(rows, columns) < 4 * WINDOW:
        return none
    left, right = _flattened(left), _flattened(right)
    here, there, towards = (left, right, -1) if reference == 'left' else (right, left, 1)
    corners = _sure_corners(here, confidence)
    shifts = towards * disparity[tuple(corners[:, ::-1].astype(int).T)]
    expected = corners + np.stack([shifts, np.zeros_like(shifts)], axis=1)
    inside = ((corners[:, 1] > WINDOW) & (corners[:, 1] < rows - WINDOW)
              & (expected[:, 0] > WINDOW) & (expected[:, 0] < columns - WINDOW))
    corners, expected = corners[inside], expected[inside]
    if not len(corners):
        return none
    options = {'winSize': (WINDOW, WINDOW), 'maxLevel': 0, 'flags': cv2.OPTFLOW_USE_INITIAL_FLOW,
               'criteria': (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 20, 0.01)}
    found, known, _ = cv2.calcOpticalFlowPyrLK(here, there, corners, expected.copy(), **options)
    back, known_back, _ = cv2.calcOpticalFlowPyrLK(there, here, found, corners.copy(), **options)
    offsets = -towards * (found - corners)[:, 1].astype(np.float64)
    good = ((known[:, 0] > 0) & (known_back[:, 0] > 0) & (np.abs(offsets) < LARGEST)
            & (np.abs(found - expected)[:, 0] < STRAYED)
            & (np.abs(back - corners).max(axis=1) < RETURNED))
    return np.column_stack([found if reference == 'left' else corners, offsets])[good]


def misalignment_of(pairs, rows, columns):
    """
    Return the Misalignment of pairs of a size, None where there are too few corners.

    pairs: a list of float64 (N, 3), as of `corner_offsets`.
    """
    column, row, offsets = np.concatenate(pairs).T
    x, y = 2 * column / (columns - 1) - 1, 2 * row / (rows - 1) - 1     # -1 to 1
    down, across = (np.clip(((place + 1) / 2 * count).astype(int), 0, count - 1)
                    for place, count in zip((y, x), TILES))
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
    # Corners of a tile are taken for one observation: what is seen often is no surer for that.
    scores = np.zeros((TILES[0] * TILES[1], 3))
    np.add.at(scores, tiles, (weights * residuals)[:, None] * terms)
    variances = np.diag(inverse @ (scores.T @ scores) @ inverse) * count / (count - 3)
    places = np.cumsum([len(one) for one in pairs])[:-1]
    swing = None
    if len(pairs) >= PAIRS_OF_SWING:
        low, high = np.percentile(
            [np.median(one) for one in np.split(residuals, places)], (10, 90))
        swing = float(high - low) / BETWEEN
    return Misalignment(float(np.median(offsets)), *map(float, plane),
                        tuple(map(float, np.sqrt(variances))), swing, len(offsets), len(pairs),
                        rows, columns)


def _flattened(image):
    """Return a grey image without what changes slowly, uint8 (R, C): cameras differ in gain."""
    grey = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY) if image.ndim == 3 else image
    mean = cv2.blur(grey, (WINDOW, WINDOW))
    gain = CONTRAST / max(cv2.mean(cv2.absdiff(grey, mean))[0], 1e-6)
    return cv2.addWeighted(grey, gain, mean, -gain, 128, dtype=cv2.CV_8U)


def _sure_corners(image, confidence):
    """Return the surer half of the corners of an image: float32 (N, 2), column, row."""
    rows, columns = (side // 2 * 2 for side in image.shape)
    half = cv2.resize(image[:rows, :columns], (columns // 2, rows // 2),
                      interpolation=cv2.INTER_AREA)
    found = cv2.goodFeaturesToTrack(
        half, CORNERS, QUALITY, DISTANCE / 2,
        mask=(confidence[:rows:2, :columns:2] > 0).astype(np.uint8))
    if found is None or not len(found):
        return np.empty((0, 2), np.float32)
    corners = 2 * found.reshape(-1, 2)
    sureness = confidence[tuple(corners[:, ::-1].astype(int).T)]
    return corners[sureness >= np.median(sureness)]
