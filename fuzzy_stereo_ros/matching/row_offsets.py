# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Measure by how much the rows of a rectified pair differ.

Not in the paper, whose pairs are rectified exactly. A point lies in the same row of both images
of a rectified pair. Where it is known which points belong together, from features that are
matched in two dimensions or from corners with a confident disparity, optical flow measures the
offset between their rows to a few hundredths of a pixel. A surface is fitted to the offsets of
many points: its value in the centre is a tilt, its slopes are roll and zoom, and its twist is a
yaw, by which rows converge to one side.
"""
from typing import NamedTuple

import cv2
from fuzzy_stereo_ros.matching.kernels.possibility.row_alignment import nearest_features
import numpy as np

LIMIT = 0.5         # px of misalignment; more impairs matching
# px of tilt, roll, zoom and yaw up to which real pairs match as well once they are undone
UNDONE_LIMITS = 8.0, 4.0, 3.0, 2.0
SURE_DEVIATIONS = 2.0  # standard deviations by which a misalignment must exceed the limit
CERTAIN = 3.0       # the same, of an offset that is undone
CORNERS = 300       # at most in a pair; the more confident half is measured
QUALITY = 0.001     # least quality of a corner, relative to the best one
DISTANCE = 16       # px, least distance of two corners
SPARE = 64          # bytes behind a row of the mask of corners: OpenCV 5.0 reads beyond its end
WINDOW = 15         # px, side of the window of the optical flow, and of the mean subtracted before
CONTRAST = 30.0     # grey levels, mean absolute deviation after normalisation
ROW_ERROR = 1.0     # px, largest distance along the row from the position of the disparity
FOUND_AGAIN = 0.1   # least share of the corners that are found, if their disparities are right
RETURN_ERROR = 0.1  # px, largest distance from the corner after the flow there and back
LARGEST_OFFSET = 10.0  # px, largest row offset; larger ones are outliers
FEATURES = 1000     # at most in an image of half size
FEATURE_SIZE = 24   # half-size px, side of the patch that a feature describes
FAST = 7            # grey levels by which a feature differs from the circle around it
# Of features that are compared wherever they lie.
REDUCED_COLUMNS = 560   # about so many, of images that are reduced to find features
COMMON, PATCH = 500, 31     # at most in an image; reduced px, side of a patch
UNIQUE = 0.85       # share of the second best distance
WANTED_CONTRAST, MOST_GAIN = 30.0, 4.0     # grey levels that a dull image gets, and largest factor
BITS_ALIKE = 60     # of 256 bits, by which two features of one point may differ
FOUND_ERROR = 3.0   # px from the matched feature that the flow may end
BEYOND = 2          # px of disparity beyond the range in which features are matched
BIN = 0.25          # px, step in which the densest offset is looked for
SPREAD = 1.5        # px around the densest offset that the fit begins with
TILES = 6, 8        # rows and columns of tiles; the errors within a tile are correlated
FEWEST = 20, 6      # points and tiles needed for a result
PAIRS_OF_SWING = 8  # pairs needed for the changes from pair to pair
TUKEY = 4.685       # width of the biweight in standard deviations
BIWEIGHT_ROUNDS = 8  # of the biweight
# px, standard deviation of offsets at the least: with less the fit keeps to the middle of an
# image, where most points are.
SMALLEST_SPREAD = 0.1
PRIOR = 1e-3, 0.5, 0.5, 0.5     # points' worth of a belief that each term is 0
PERCENTILE_WIDTH = 2.563    # standard deviations between the 10th and the 90th percentile
TERMS = 'tilt', 'roll', 'zoom', 'yaw'
MEASURED = 'row offset, measured'       # key of diagnostics
NOT_MEASURED = 'not measured: too few points are found in both images'


class Misalignment(NamedTuple):
    """
    The offset between the rows of a rectified pair, px; positive: the right image is lower.

    tilt: in the centre of the image. roll: further offset at the right edge, its negative at the
    left edge. zoom: further offset at the lower edge, its negative at the upper edge. yaw: further
    offset in the upper left and the lower right corner, its negative in the others.
    doubts: standard deviations of these four. swing: standard deviation of the offset between
    pairs; None for too few pairs. points, pairs: their numbers. rows, columns: size of the images.
    undone: whether the right image was aligned before it was matched.
    """

    tilt: float
    roll: float
    zoom: float
    yaw: float
    doubts: tuple
    swing: float | None
    points: int
    pairs: int
    rows: int
    columns: int
    undone: bool = False

    @property
    def terms(self):
        """Tilt, roll, zoom and yaw: float64 (4,), px."""
        return np.array(self[:4])

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
        """The list of 'tilt', 'roll', 'zoom', 'yaw', 'timing' that surely exceed the limit."""
        return self._beyond(4 * (LIMIT,))

    @property
    def warns(self):
        """Whether matches are lost: a fault is not undone, or too large to be undone well."""
        return bool(self._beyond(UNDONE_LIMITS) if self.undone else self.faults)

    def _beyond(self, limits):
        return [name for name, value, doubt, limit in zip(
            (*TERMS, 'timing'), (*self[:4], self.swing or 0), (*self.doubts, 0), (*limits, LIMIT))
            if abs(value) - SURE_DEVIATIONS * doubt > limit]

    @property
    def advice(self):
        """A sentence that says what is wrong and what to do; '' without faults."""
        words = {
            'tilt': f'the right image is {abs(self.tilt):.2f} px too '
                    f'{"low" if self.tilt > 0 else "high"} (one camera is tilted, or rows are '
                    'cut off)',
            'roll': f'the right camera is turned by {self.roll_degrees:+.2f} degrees about its '
                    f'optical axis ({abs(self.roll):.2f} px at the left and right edges)',
            'zoom': f'the right image is {self.zoom_percent:+.2f} % larger '
                    f'({abs(self.zoom):.2f} px at the upper and lower edges)',
            'yaw': f'rows converge to the {"left" if self.yaw > 0 else "right"} (one camera is '
                   f'turned inwards; {abs(self.yaw):.2f} px in the corners)',
            'timing': f'the offset swings by {self.swing or 0:.2f} px from pair to pair (the '
                      'cameras do not expose at one moment, or move against each other)'}
        faults = self.faults
        if not faults:
            return ''
        if faults == ['timing']:
            return f"synchronise the exposures: {words['timing']}"
        undone = '; all but the swing is undone before matching' if 'timing' in faults else (
            '; undone before matching' + ', but matches are lost' * self.warns)
        return ('recalibrate: ' + '; '.join(words[fault] for fault in faults)
                + undone * self.undone)

    @property
    def figures(self):
        """The figures with their standard deviations, for diagnostics: {name: text}."""
        return {**{f'row offset, {name}': f'{value:+.2f} +- {doubt:.2f} px'
                   for name, value, doubt in zip(TERMS, self, self.doubts)},
                'row offset, swing': 'unknown' if self.swing is None else f'{self.swing:.2f} px',
                MEASURED: f'{self.points} points of {self.pairs} pair' + 's' * (self.pairs != 1),
                'row offset, undone': 'yes' if self.undone else 'no'}

    @property
    def record(self):
        """The figures as numbers, for JSON."""
        return {**self._asdict(), 'roll_degrees': self.roll_degrees,
                'zoom_percent': self.zoom_percent, 'faults': self.faults, 'advice': self.advice}

    def deviation(self, terms):
        """Return by how much, px, the offset surely differs from terms (4,) at most, anywhere."""
        differences = np.abs(PLACES @ (self.terms - terms))
        return float(np.max(differences - CERTAIN * self.doubts_at_places))

    @property
    def doubts_at_places(self):
        """Standard deviations of the offset at PLACES, px: float64 (9,)."""
        return np.sqrt(PLACES**2 @ np.square(self.doubts))

    def of_the_right(self):
        """Return that of the right image against the left, of one found in the mirrored pair."""
        return self._replace(tilt=-self.tilt, zoom=-self.zoom)


def row_offset_in_words(found):
    """Return the figures and the advice of a Misalignment, None = too few points, in words."""
    if found is None:
        return NOT_MEASURED
    parts = (f'{name} {value:+.2f} +- {doubt:.2f}' for name, value, doubt in zip(
        TERMS, found, found.doubts))
    end = found.advice or (f'OK (limit {LIMIT})' + ', undone before matching' * found.undone)
    return f"right image against left, {', '.join(parts)} px: {end}"


def terms_at(column, row, rows, columns):
    """Return what each of the TERMS is multiplied by at a place of an image: float64 (N, 4)."""
    x, y = 2 * column / max(columns - 1, 1) - 1, 2 * row / max(rows - 1, 1) - 1
    return np.stack([np.ones_like(x), x, y, x * y], axis=1)


# Where offsets are compared: the centre, the corners and the middles of the edges.
PLACES = terms_at(*np.mgrid[:3, :3].reshape(2, -1).astype(float), 3, 3)


class CommonFeatures(NamedTuple):
    """
    Features that two images have in common, px of the images as they are.

    number: of features of the left image, before any were compared. places: float64 (N, 2),
    column and row in the right image. disparities, lower: float64 (N,), by how much the
    feature is farther left and lower in the right image. pixel: px of a reduced image's pixel.
    """

    number: int
    places: np.ndarray
    disparities: np.ndarray
    lower: np.ndarray
    pixel: int


def features_in_common(left, right):
    """Return the features, by ORB of one scale, that are each other's best of two uint8 (R, C)."""
    pixel = max(1, round(left.shape[1] / REDUCED_COLUMNS))
    none = CommonFeatures(0, np.empty((0, 2)), np.empty(0), np.empty(0), pixel)
    if min(left.shape) < 2 * PATCH * pixel:
        return none
    (ours, our_bits), (theirs, their_bits) = (_features(
        _with_contrast(reduced(image, pixel)), pixel, COMMON, PATCH) for image in (left, right))
    if min(len(ours), len(theirs)) < 2:
        return none._replace(number=len(ours))
    matcher = cv2.BFMatcher(cv2.NORM_HAMMING)
    back = {one.queryIdx: one.trainIdx for one in matcher.match(their_bits, our_bits)}
    chosen = [(best.queryIdx, best.trainIdx)
              for best, second in matcher.knnMatch(our_bits, their_bits, 2)
              if best.distance < min(UNIQUE * second.distance, BITS_ALIKE)
              and back[best.trainIdx] == best.queryIdx]
    mine, its = np.array(chosen, int).reshape(-1, 2).T
    places = theirs[its].astype(np.float64)
    disparities, higher = (ours[mine] - places).T
    return CommonFeatures(len(ours), places, disparities, -higher, pixel)


def _with_contrast(image):
    """Return an image, a dull one with more contrast: uint8."""
    mean, spread = (one.item() for one in cv2.meanStdDev(image))
    gain = float(np.clip(WANTED_CONTRAST / max(spread, 1e-6), 1, MOST_GAIN))
    return cv2.addWeighted(image, gain, image, 0, (1 - gain) * mean)


def feature_offsets(left, right, min_disparity, disparities, each=map):
    """
    Return points of a pair, found without a disparity: float64 (N, 3).

    Column and row in the right image, and row offset, px. ORB features (Rublee et al., 2011) of
    half-size images are matched in two dimensions: along rows within the range of disparities,
    and up to LARGEST_OFFSET across them. left, right: uint8 (R, C), `normalised`; each: `map`, or
    `mapped` of a ThreadPool.
    """
    rows, columns = left.shape[:2]
    if min(rows, columns) < 4 * WINDOW:
        return np.empty((0, 3))
    (there, left_bits), (here, right_bits) = each(
        lambda image: _features(reduced(image, 2), 2, FEATURES, FEATURE_SIZE), (left, right))
    if not len(there) or not len(here):
        return np.empty((0, 3))
    least, most = min_disparity - BEYOND, min_disparity + disparities + BEYOND - 1
    (forth, distances), (back, _) = each(lambda way: _nearest(*way), (
        (there, left_bits, here, right_bits, least, most),
        (here, right_bits, there, left_bits, -most, -least)))
    # clip: a dry run of the warm-up writes any numbers
    first = np.flatnonzero(
        (distances < BITS_ALIKE) & (back.take(forth, mode='clip') == np.arange(len(there))))
    return _flow(left, right, there[first], here.take(forth[first], axis=0, mode='clip'),
                 FOUND_ERROR)


def corner_offsets(left, right, disparity, confidence, terms=(0.0, 0.0, 0.0, 0.0)):
    """Return points as `feature_offsets` of a pair with a disparity and an expected row offset."""
    rows, columns = disparity.shape
    if min(rows, columns) < 4 * WINDOW:
        return np.empty((0, 3))
    corners = _confident_corners(left, confidence)
    column, row = corners.astype(int).T
    expected = corners.copy()
    expected[:, 0] -= disparity[row, column]
    expected[:, 1] += terms_at(*expected.T.astype(float), rows, columns) @ np.array(terms)
    found = _flow(left, right, corners, expected, ROW_ERROR)
    return found if len(found) >= FOUND_AGAIN * len(corners) else found[:0]


def _flow(left, right, corners, expected, row_error):
    """Return points of corners, float32 (N, 2), that lie within row_error px of where expected."""
    rows, columns = left.shape
    inside = ((corners[:, 1] > WINDOW) & (corners[:, 1] < rows - WINDOW)
              & (expected[:, 0] > WINDOW) & (expected[:, 0] < columns - WINDOW))
    corners, expected = corners[inside], expected[inside]
    if not len(corners):
        return np.empty((0, 3))
    options = {'winSize': (WINDOW, WINDOW), 'maxLevel': 0, 'flags': cv2.OPTFLOW_USE_INITIAL_FLOW,
               'criteria': (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 20, 0.01)}
    found, known, _ = cv2.calcOpticalFlowPyrLK(left, right, corners, expected.copy(), **options)
    back, known_back, _ = cv2.calcOpticalFlowPyrLK(right, left, found, corners.copy(), **options)
    offsets = (found - corners)[:, 1].astype(np.float64)
    good = ((known[:, 0] > 0) & (known_back[:, 0] > 0) & (np.abs(offsets) < LARGEST_OFFSET)
            & (np.abs(found - expected)[:, 0] < row_error)
            & (np.abs(back - corners).max(axis=1) < RETURN_ERROR))
    return np.column_stack([found, offsets])[good]


def misalignment_of(pairs, rows, columns):
    """Return the Misalignment of pairs, each points as float64 (N, 3), None for too few."""
    column, row, offsets = np.concatenate(pairs).T
    terms = terms_at(column, row, rows, columns)
    down, across = (np.clip(((place + 1) / 2 * count).astype(int), 0, count - 1)
                    for place, count in zip((terms[:, 2], terms[:, 1]), TILES))
    tiles = down * TILES[1] + across
    count = len(np.unique(tiles))
    if len(offsets) < FEWEST[0] or count < FEWEST[1]:
        return None
    found, spread = np.array([_densest(offsets), 0.0, 0.0, 0.0]), SPREAD
    for _ in range(BIWEIGHT_ROUNDS):
        residuals = offsets - terms @ found
        weights = np.maximum(1 - (residuals / (TUKEY * spread)) ** 2, 0) ** 2
        inverse = np.linalg.inv(terms.T @ (weights[:, None] * terms) + np.diag(PRIOR))
        found = inverse @ (terms.T @ (weights * offsets))
        residuals = offsets - terms @ found
        near = np.abs(residuals)[np.abs(residuals) < 2 * SPREAD]
        if len(near) < FEWEST[0]:
            return None
        spread = min(max(1.4826 * float(np.median(near)), SMALLEST_SPREAD), SPREAD)
    # The points of a tile count as one observation, as their errors are correlated.
    scores = np.zeros((TILES[0] * TILES[1], len(TERMS)))
    np.add.at(scores, tiles, (weights * residuals)[:, None] * terms)
    variances = np.diag(inverse @ (scores.T @ scores) @ inverse) * count / max(
        count - len(TERMS), 1)
    ends = np.cumsum([len(one) for one in pairs])[:-1]
    medians = [np.median(one) for one in np.split(residuals, ends) if _is_sure(one)]
    swing = None
    if len(medians) >= PAIRS_OF_SWING:
        low, high = np.percentile(medians, (10, 90))
        swing = float(high - low) / PERCENTILE_WIDTH
    if len(medians) > 1:        # where exposures swing, pairs differ by more than their points
        count = len(medians)    # of few pairs the variance is itself not sure
        variances[0] += np.var(medians) / count * (count + 2) / (count - 1)
    return Misalignment(*map(float, found), tuple(map(float, np.sqrt(variances))), swing,
                        len(offsets), len(pairs), rows, columns)


def _is_sure(offsets):
    """Return whether the points of a pair tell its offset, as those of wrong matches do not."""
    spread = 1.4826 * np.median(np.abs(offsets - np.median(offsets))) if len(offsets) else 0.0
    return len(offsets) >= FEWEST[1] and spread < SMALLEST_SPREAD * len(offsets)**0.5


def _densest(offsets):
    """Return the offset around which most offsets lie; of equals the smallest."""
    places = np.arange(-LARGEST_OFFSET, LARGEST_OFFSET + BIN, BIN)
    places = places[np.argsort(np.abs(places), kind='stable')]
    density = np.maximum(1 - np.abs(offsets - places[:, None]) / SPREAD, 0).sum(axis=1)
    return float(places[np.argmax(density)])


def grey(image):
    """Return an image, uint8 or uint16, (R, C) or (R, C, 3) BGR, in grey: (R, C)."""
    return image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)


def normalised(image):
    """Return a grey image without its local mean, at equal contrast, as gains differ: uint8."""
    image = grey(image)
    mean = cv2.blur(image, (WINDOW, WINDOW))
    gain = CONTRAST / max(cv2.mean(cv2.absdiff(image, mean))[0], 1e-6)
    return cv2.addWeighted(image, gain, mean, -gain, 128, dtype=cv2.CV_8U)


def reduced(image, pixel):
    """Return a grey image of larger pixels, at least one; rows and columns left over are cut."""
    rows, columns = (max(side // pixel, 1) for side in image.shape)
    return image if pixel == 1 else cv2.resize(
        image[:rows * pixel, :columns * pixel], (columns, rows), interpolation=cv2.INTER_AREA)


def _features(image, pixel, number, side):
    """Return places, float32 (N, 2) column and row, and uint8 (N, 32) bits in a reduced image."""
    detector = cv2.ORB_create(number, nlevels=1, edgeThreshold=(side + 1) // 2, patchSize=side,
                              fastThreshold=FAST)
    found, bits = detector.detectAndCompute(image, None)
    return pixel * cv2.KeyPoint.convert(found) + np.float32((pixel - 1) / 2), bits


def _nearest(places, bits, other_places, other_bits, lowest, highest):
    """Return the features most like each and their distances, see `nearest_features`."""
    nearest, distances = (np.empty(len(places), np.int32) for _ in range(2))
    order = np.argsort(other_places[:, 1])
    ascending = np.ascontiguousarray(other_places[order].T)
    begins = np.searchsorted(ascending[1], places[:, 1] - np.float32(LARGEST_OFFSET))
    nearest_features(
        (np.ascontiguousarray(places.T), bits.view(np.uint32), begins),
        (ascending, other_bits[order].view(np.uint32), order),
        *map(np.float32, (lowest, highest, LARGEST_OFFSET)), nearest, distances)
    return nearest, distances


def _confident_corners(image, confidence):
    """Return the more confident half of an image's corners: float32 (N, 2), column, row."""
    half = reduced(image, 2)
    trusted = confidence[:2 * half.shape[0]:2, :2 * half.shape[1]:2] > 0
    mask = np.pad(trusted, ((0, 0), (0, SPARE)))[:, :-SPARE].view(np.uint8)
    found = cv2.goodFeaturesToTrack(half, CORNERS, QUALITY, DISTANCE / 2, mask=mask)
    if found is None or not len(found):
        return np.empty((0, 2), np.float32)
    corners = 2 * found.reshape(-1, 2)
    confidences = confidence[tuple(corners[:, ::-1].astype(int).T)]
    return corners[confidences >= np.median(confidences)]
