# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Find out why little of a pair can be matched: a named finding, its cause and its remedy.

Not in the paper, whose pairs are of one scene, rectified and within the range. Matching along rows
finds something in any two images, so its result alone does not tell what is wrong. Where
confidence is low, or disparities end at the end of the range, features of both images are compared
without regard to rows, range and sides: where they agree says whether rows are apart, left and
right are swapped, the range is too short, or the images do not belong together. Brightness and
texture say whether there are features at all.
"""
from collections import deque
import time
from typing import NamedTuple

import cv2
from fuzzy_stereo_ros.matching.row_offsets import misalignment_of, terms_at
import numpy as np

TIME_SHARE = 0.004  # share of the matching time that may be spent on the search for causes
MOST_CREDIT = 20.0  # ms of this time that are saved up while nothing is suspicious
CONFIRMED = 5       # pairs in a row after which a live node changes its finding
SAMPLE_STEP = 4     # every so many rows and columns of a result are read
# Limits of a suspicious result; real pairs have a mean confidence of .36 to .97, most above .65.
LOW_CONFIDENCE = 0.65
FALL = 0.75         # share of the usual mean confidence
MEMORY = 0.02       # weight of the newest pair in the usual confidence
LAST_LABELS = 3     # labels that count as the end of the range
AT_THE_END = 0.05   # share of the valid pixels that have one of these
NEARER = 0.01       # share of the matches that are rejected as beyond the range
# Pictures, in grey levels of 8 bits.
BLACK, WHITE = 20, 250
FEWEST_BITS = 12    # least number of bits that images of 16 bits are assumed to use
REDUCED = 4         # factor by which images are reduced to measure contrast without noise
CONTRAST = 6        # grey levels between two pixels of these, two apart
PLAIN, TEXTURED = 0.02, 0.1     # shares of an image with contrast
# Features of both images, reduced to about this many columns.
REDUCED_COLUMNS, FEATURES, PATCH = 560, 500, 31
UNIQUE, LIKE = 0.85, 60         # share of the second best distance, and bits of 256
TOLERANCE = 1.5     # reduced px, by which the rows of a feature may differ
FEWEST_FEATURES = 20  # features that have to agree
MANY, UNLIKE, UNSURE = 100, 10, 0.4     # features, most that agree, mean confidence: other scenes
BEYOND, FEWEST_BEYOND = 0.05, 8     # features that lie beyond the range
RANGE_MARGIN = 2    # px, around the disparities of features, of a proposed range
ROUNDED = 16        # a proposed number of disparities is a multiple of it


class Finding(NamedTuple):
    """
    Why little of a pair can be matched.

    cause: 'dark', 'overexposed', 'covered', 'plain', 'swapped', 'rows', 'range', 'unlike' or
    'deadline'. sentence: what is wrong, by which figures, and what to do. warns: whether something
    is wrong; a plain wall that fills the pictures is not.
    """

    cause: str
    sentence: str
    warns: bool = True


class PlausibilityCheck:
    """
    Watches results of consecutive pairs and looks for the cause where they are suspicious.

    finding: the newest `Finding`, None if nothing is suspicious or no cause is known.
    """

    def __init__(self, confirmed=1, scale=1.0):
        """
        Start without pairs.

        confirmed: pairs in a row that change the finding. scale: of the images; findings name a
        range in px of the images before they were reduced.
        """
        self._confirmed, self._scale = confirmed, scale
        self._credit, self._known_for = 0.0, None
        self.reset()

    def reset(self):
        """Forget all pairs."""
        self.finding, self._usual = None, None
        self._suspicions = deque(maxlen=self._confirmed)

    def warm_up(self):
        """Compare two images of noise, as OpenCV loads parts of itself at the first call."""
        noise = np.random.default_rng(0).integers(0, 255, (200, 200), np.uint8)
        features_in_common(noise, noise)

    def add_within_share(self, left, right, match, config):
        """Do as `add`, but look for a cause only within a share of the time of matching."""
        self._credit = min(self._credit + TIME_SHARE * match.times['total'], MOST_CREDIT)
        known_for = left.shape, config
        if known_for != self._known_for:
            self._known_for, self._credit = known_for, 0.0
            self.reset()
        if self._is_suspicious(match, config) and self._credit >= 0:
            started = time.perf_counter()
            self.finding = cause_of(left, right, match, config, self._scale)
            self._credit -= 1000 * (time.perf_counter() - started)

    def add(self, left, right, match, config):
        """
        Add a pair and its Match; return the finding.

        left, right: uint8 or uint16, (R, C) or (R, C, 3) BGR. config: a MatcherConfig, in px of
        these images.
        """
        if self._is_suspicious(match, config):
            self.finding = cause_of(left, right, match, config, self._scale)
        return self.finding

    def _is_suspicious(self, match, config):
        """Return whether all newest pairs are suspicious; if none is, there is no finding."""
        confidence = mean_confidence(match)
        usual = self._usual = confidence if self._usual is None else self._usual
        self._suspicions.append(
            confidence < max(LOW_CONFIDENCE, FALL * usual)
            or share_at_the_end(match, config) > AT_THE_END or match.beyond > NEARER
            or is_late(match, config))
        self._usual += MEMORY * (confidence - usual)
        if self.finding is not None and not any(self._suspicions):
            self.finding, self._credit = None, 0.0      # the next suspicious pair is examined
        return len(self._suspicions) == self._confirmed and all(self._suspicions)


def mean_confidence(match):
    """Return the mean confidence of a Match, 0 to 1."""
    return float(match.confidence[::SAMPLE_STEP, ::SAMPLE_STEP].mean())


def share_at_the_end(match, config):
    """Return the share of the valid disparities that lie at the end of the range, 0 to 1."""
    disparity = match.disparity[::SAMPLE_STEP, ::SAMPLE_STEP]
    last = config.min_disparity + config.disparities - LAST_LABELS
    return np.count_nonzero(disparity >= last) / max(np.count_nonzero(disparity == disparity), 1)


def is_late(match, config):
    """Return whether the deadline ended the match before its first generation."""
    return (0 < config.deadline_ms < match.times['total'] and config.generations > 0
            and match.generations == 0 and not match.reused)


def cause_of(left, right, match, config, scale=1.0):
    """
    Return the Finding that explains a suspicious Match, None if no cause is known.

    Arguments as for `PlausibilityCheck` and its `add`.
    """
    images = _in_grey(left, right)
    found = (_of_pictures(images) or _of_features(*images, match, config, scale)
             or _of_matches(match, config, scale))
    if found is None and is_late(match, config):
        found = Finding('deadline', f'the deadline of {config.deadline_ms:g} ms ended before the '
                        f'first generation, after {match.times["total"]:.0f} ms; the result is '
                        'where evolution would start: raise deadline_ms, or search fewer '
                        'disparities in smaller images')
    return found


def _of_pictures(images):
    """Return the Finding of two grey pictures that show nothing, None if both show something."""
    brightest, darkest = ([float(np.percentile(image[::SAMPLE_STEP, ::SAMPLE_STEP], percent))
                           for image in images] for percent in (99, 10))
    dark = _names([value < BLACK for value in brightest])
    if dark:
        return Finding('dark', f'the {dark} black (brightness {max(min(brightest), 0):.0f} of '
                       '255): uncover the lens, switch on a light, or expose longer')
    white = _names([value > WHITE for value in darkest])
    if white:
        return Finding('overexposed', f'the {white} white (brightness {max(darkest):.0f} of '
                       '255): expose shorter, or shade the lens')
    shares = [textured_share(image) for image in images]
    if max(shares) < PLAIN:
        return Finding('plain', f'little texture: {100 * max(shares):.1f} % of the pictures have '
                       'contrast, as of a plain wall that fills them; what is matched there is '
                       'uncertain', warns=False)
    plain = _names([share < PLAIN for share in shares])
    if plain and max(shares) > TEXTURED:
        return Finding('covered', f'the {plain} without contrast ({100 * min(shares):.1f} % of '
                       f'it has any, {100 * max(shares):.0f} % of the other): uncover or clean '
                       'the lens, or focus it')
    return None


def _names(chosen):
    """Return which of the left and the right image are chosen, with a verb; '' for none."""
    names = [side for side, one in zip(('left', 'right'), chosen) if one]
    return ' and '.join(names) + ('', ' image is', ' images are')[len(names)]


def textured_share(image):
    """Return the share of a grey image, uint8 (R, C), that has contrast, 0 to 1."""
    rows, columns = (max(side // REDUCED, 1) for side in image.shape)
    small = cv2.resize(image, (columns, rows), interpolation=cv2.INTER_AREA).astype(np.int16)
    steps = np.maximum(np.abs(small[1:-1, 2:] - small[1:-1, :-2]),
                       np.abs(small[2:, 1:-1] - small[:-2, 1:-1]))
    return float(np.mean(steps > CONTRAST)) if steps.size else 0.0


class Features(NamedTuple):
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
    """
    Return the Features of two grey images, uint8 (R, C), wherever they lie in both.

    ORB (Rublee et al., ICCV 2011) of one scale and turn; both have to be each other's best match.
    """
    pixel = max(1, round(left.shape[1] / REDUCED_COLUMNS))
    none = Features(0, np.empty((0, 2)), np.empty(0), np.empty(0), pixel)
    if min(left.shape) < 2 * PATCH * pixel:
        return none
    detector = cv2.ORB_create(nfeatures=FEATURES, nlevels=1, edgeThreshold=PATCH // 2 + 1,
                              patchSize=PATCH, fastThreshold=7)
    (ours, our_bits), (theirs, their_bits) = (
        detector.detectAndCompute(_reduced(image, pixel), None) for image in (left, right))
    if min(len(ours), len(theirs)) < 2:
        return none._replace(number=len(ours))
    matcher = cv2.BFMatcher(cv2.NORM_HAMMING)
    back = {one.queryIdx: one.trainIdx for one in matcher.match(their_bits, our_bits)}
    chosen = [(*ours[best.queryIdx].pt, *theirs[best.trainIdx].pt)
              for best, second in matcher.knnMatch(our_bits, their_bits, 2)
              if best.distance < min(UNIQUE * second.distance, LIKE)
              and back[best.trainIdx] == best.queryIdx]
    x, y, other_x, other_y = pixel * np.array(chosen, np.float64).reshape(-1, 4).T
    return Features(len(ours), np.stack([other_x, other_y], 1), x - other_x, other_y - y, pixel)


def _of_features(left, right, match, config, scale):
    """Return the Finding by the features of two grey images, None without one."""
    features, rows = features_in_common(left, right), match.misalignment
    if rows is not None and rows.undone:
        features = features._replace(lower=features.lower - terms_at(
            *features.places.T, *left.shape) @ rows.terms)
    apart = _apart(features, left.shape)
    agree = np.abs(features.lower - apart) <= TOLERANCE * features.pixel
    number = np.count_nonzero(agree)
    if features.number > MANY and number < UNLIKE and mean_confidence(match) < UNSURE:
        return Finding('unlike', f'the images do not show the same: {number} of '
                       f'{features.number} features of the left image are found in the right '
                       'one; see that both are of one stereo camera, of one moment, and in focus')
    if number < FEWEST_FEATURES:
        return None
    swapped = _swapped(features.disparities[agree], features.pixel, config)
    if swapped is not None:
        return swapped
    fit = np.abs(features.lower) <= TOLERANCE * features.pixel
    if 2 * np.count_nonzero(agree & fit) < number:
        low, high = np.percentile(apart[agree], (5, 95))
        if high - low > 2:
            where = f'{low:+.0f} to {high:+.0f} px lower'
        else:
            where = f'{abs(low + high) / 2:.0f} px {"lower" if low + high > 0 else "higher"}'
        return Finding('rows', f'the rows of the images do not fit: {number} features lie '
                       f'{where} in the right image; rectify the images, or calibrate the two '
                       'cameras as a pair')
    return _of_range(features.disparities[agree], features.pixel, config, scale)


def _apart(features, shape):
    """Return by how much the row of each feature is expected to be lower in the right image."""
    if not len(features.lower):
        return np.zeros(0)
    middle = float(np.median(features.lower))
    surface = misalignment_of(
        [np.column_stack([features.places, features.lower - middle])], *shape)
    return middle + (0 if surface is None else terms_at(
        *features.places.T, *shape) @ surface.terms) * np.ones(len(features.lower))


def _swapped(disparities, pixel, config):
    """Return the Finding that the images are swapped, None if they are not."""
    first, last = config.min_disparity - pixel, config.min_disparity + config.disparities
    fit, exchanged = (np.count_nonzero((signed >= first) & (signed <= last))
                      for signed in (disparities, -disparities))
    if exchanged < max(2 * fit, FEWEST_FEATURES):
        return None
    return Finding('swapped', f'left and right are swapped: of {len(disparities)} features in '
                   f'common {fit} lie within the range as the images are, {exchanged} if they are '
                   'exchanged; exchange the images and their camera_info')


def _of_range(disparities, pixel, config, scale):
    """Return the Finding that the range leaves features out, None if it does not."""
    first, last = config.min_disparity, config.min_disparity + config.disparities - 1
    least, most = np.percentile(disparities, (1, 99)) / scale
    searched = f'searched are {first / scale:.0f} to {last / scale:.0f}'
    nearer, farther = (np.count_nonzero(outside) for outside in (
        disparities > last + pixel, disparities < first - pixel))
    fewest = max(FEWEST_BEYOND, BEYOND * len(disparities))
    if nearer >= fewest:
        needed = -(-(most + RANGE_MARGIN - first / scale) // ROUNDED) * ROUNDED
        return Finding('range', f'{100 * nearer / len(disparities):.0f} % of the features in '
                       f'common are nearer than the range reaches (up to {most:.0f} px, '
                       f'{searched}): search {needed:.0f} disparities')
    if farther >= fewest:
        return Finding('range', f'{100 * farther / len(disparities):.0f} % of the features in '
                       f'common are farther than the range begins (from {least:.0f} px, '
                       f'{searched}): lower min_disparity to {least - RANGE_MARGIN:.0f}')
    return None


def _of_matches(match, config, scale):
    """Return the Finding that a part of the matches lies beyond the range, None if few do."""
    if match.beyond <= NEARER:
        return None
    last = (config.min_disparity + config.disparities - 1) / scale
    needed = -(-match.enough / scale // ROUNDED) * ROUNDED
    return Finding('range', f'{100 * match.beyond:.1f} % of the matches are nearer than the range '
                   f'reaches (disparity above {last:.0f}) and were rejected: search {needed:.0f} '
                   'disparities or more')


def _in_grey(*images):
    """Return the images of a pair in grey, the upper 8 of the bits that they use: uint8 (R, C)."""
    images = [cv2.cvtColor(image, cv2.COLOR_BGR2GRAY) if image.ndim == 3 else image
              for image in images]
    if images[0].dtype == np.uint8:
        return images
    bits = max(FEWEST_BITS, *(int(image.max()).bit_length() for image in images))
    return [(image >> (bits - 8)).astype(np.uint8) for image in images]


def _reduced(image, pixel):
    rows, columns = (side // pixel for side in image.shape)
    return image if pixel == 1 else cv2.resize(
        image[:rows * pixel, :columns * pixel], (columns, rows), interpolation=cv2.INTER_AREA)
