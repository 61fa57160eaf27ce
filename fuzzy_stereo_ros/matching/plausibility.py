# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Find out why little of a pair can be matched: a named finding, its cause and its remedy.

Not in the paper, whose pairs are of one scene, rectified and within the range. Matching along rows
finds something in any two images, so its result alone does not tell what is wrong. Some causes are
seen at sight: by brightness and texture, or as a picture that is that of the other side, or of the
pair before. Else features of both images are compared without regard to rows, range and sides:
where they agree says whether rows are apart, left and right are swapped, one camera has turned,
the range is too short, or the images do not belong together.
"""
from collections import deque
import time
from typing import NamedTuple

import cv2
from fuzzy_stereo_ros.matching.out_of_range import proposed
from fuzzy_stereo_ros.matching.row_offsets import (
    features_in_common, grey, misalignment_of, reduced, terms_at)
import numpy as np

TIME_SHARE = 0.004  # share of the matching time that may be spent on the search for causes
KNOWN_SHARE = 0.02  # the same while a cause is known that may end at any time
MOST_CREDIT = 20.0  # ms of this time that are saved up while nothing is suspicious
CONFIRMED = 5       # pairs in a row after which a live node changes its finding
SAMPLE_STEP = 4     # every so many rows and columns of a result are read
# Limits of a suspicious result; real pairs have a mean confidence of .36 to .97, most above .65.
LOW_CONFIDENCE = 0.65
FALL = 0.75         # share of the usual mean confidence
MEMORY = 0.02       # weight of the newest pair in the usual confidence
LAST_LABELS = 3     # labels that count as the end of the range
AT_THE_ENDS = 0.05  # share of the valid pixels that have one of these, or are beyond infinity
NEARER = 0.01       # share of the matches that are rejected as beyond the range
# Pictures, in grey levels of 8 bits.
BLACK, WHITE = 20, 250
FEWEST_BITS = 12    # least number of bits that images of 16 bits are assumed to use
BRIGHTEST, DARKEST = 99, 10     # percentiles; hot pixels do not count
REDUCED = 4         # factor by which images are reduced to measure contrast without noise
CONTRAST = 6        # grey levels between two pixels of these, two apart
PLAIN, TEXTURED = 0.02, 0.1     # shares of an image with contrast
COMPARED = np.s_[::16, ::4]     # rows and columns that are compared, of images that may be equal
EQUAL = 0.99        # share of their pixels that differ by no more than rounding, 1 level
CHANGED = 0.05      # least share of the pixels that change from pair to pair, if only by noise
# Features of both images.
TOLERANCE = 1.5     # reduced px, by which the rows of a feature may differ
FARTHER = 2.0       # reduced px beyond infinity that errors of features do not explain
FLAT = 2.0          # reduced px between near and far features of a wall that faces the cameras
FEWEST_FEATURES = 20  # features that have to agree
# Features, most that agree, and mean confidences: of two scenes.
MANY, UNLIKE, UNSURE, UNSURE_PAPER = 100, 10, 0.4, 0.65
OUTNUMBERED = 10    # times as many features are farther than infinity as if they are exchanged
TURNED = 0.25       # share of the features that are farther than infinity
BEYOND, FEWEST_BEYOND = 0.05, 8     # features that lie beyond the range
RANGE_MARGIN = 2    # px, around the disparities of features, of a proposed range


class Finding(NamedTuple):
    """
    Why little of a pair can be matched.

    cause: 'dark', 'overexposed', 'covered', 'plain', 'same', 'frozen', 'swapped', 'rows',
    'turned', 'range', 'unlike' or 'deadline'. sentence: what is wrong, by which figures, and what
    to do. warns: whether something is wrong; a plain wall that fills the pictures is not.
    needed: of 'range' the least and the largest disparity to be searched, px; else ().
    """

    cause: str
    sentence: str
    warns: bool = True
    needed: tuple = ()


class PlausibilityCheck:
    """Looks why results are suspicious; finding: the newest `Finding`, None without a cause."""

    def __init__(self, confirmed=1, scale=1.0):
        """Start; confirmed: pairs in a row that change the finding; scale: of the images."""
        self._confirmed, self._scale = confirmed, scale
        self._credit, self._known_for, self.finding = 0.0, None, None
        self.reset()

    def reset(self):
        """Forget all pairs."""
        self._usual = None
        self.interrupt()

    def interrupt(self):
        """End the finding and all suspicions, as when a pair is missing or cannot be matched."""
        self._credit *= not self.finding    # else the next suspicious pair is examined
        self.finding, self._at_sight = None, False
        self._suspicions = deque(maxlen=self._confirmed)
        self._compared, self._still = None, [0, 0]

    def warm_up(self):
        """Compare two images of noise, as OpenCV loads parts of itself at the first call."""
        noise = np.random.default_rng(0).integers(0, 255, (200, 200), np.uint8)
        features_in_common(noise, noise)

    def add(self, left, right, match, config, infinity=None):
        """
        Add a pair and its Match; return the finding.

        left, right: uint8 or uint16, (R, C) or (R, C, 3) BGR. config: a MatcherConfig, in px of
        these images. infinity: disparity of infinitely far points, px, None where not calibrated.
        """
        self._credit = MOST_CREDIT
        return self.add_within_share(left, right, match, config, infinity)

    def add_within_share(self, left, right, match, config, infinity=None):
        """Do as `add`, but compare features only within a share of the time of matching."""
        known_for = left.shape, config
        if known_for != self._known_for:
            self._known_for, self._credit = known_for, 0.0
            self.reset()
        share = KNOWN_SHARE if self.finding and self.finding.warns else TIME_SHARE
        self._credit = min(self._credit + share * match.times['total'], MOST_CREDIT)
        if self._is_suspicious(left, right, match, config, infinity):
            self._look(Observed(left, right, match, config, self._scale, infinity, self._still))
        return self.finding

    def _look(self, seen):
        """Look for the cause of a suspicious pair."""
        found = _first(AT_SIGHT, seen)
        if found:
            self.finding, self._at_sight = found, True
        elif self.finding and self._at_sight:
            self.interrupt()        # it has ended, and the newest pairs say nothing of others
        elif self._credit >= 0 and not any(self._still):    # features of two moments mislead
            started = time.perf_counter()
            self.finding, self._at_sight = _first(CLOSER, seen.closer()), False
            self._credit -= 1000 * (time.perf_counter() - started)

    def _is_suspicious(self, left, right, match, config, infinity):
        """Return whether all newest pairs are suspicious; if none is, there is no finding."""
        confidence = mean_confidence(match)
        usual = self._usual = confidence if self._usual is None else self._usual
        self._note_still(left, right)
        self._suspicions.append(
            confidence < max(LOW_CONFIDENCE, FALL * usual)
            or share_at_the_ends(match, config, infinity or 0.0) > AT_THE_ENDS
            or match.beyond > NEARER or is_late(match, config) or any(self._still)
            or is_one_picture(left, right))
        self._usual += MEMORY * (confidence - usual)
        if self.finding is not None and not any(self._suspicions):
            self.finding, self._credit = None, 0.0      # the next suspicious pair is examined
        return len(self._suspicions) == self._confirmed and all(self._suspicions)

    def _note_still(self, left, right):
        """Count for how many pairs either image has stayed the same while the other changed."""
        before, self._compared = self._compared, [
            image[COMPARED].copy() for image in (left, right)]
        changed = [np.mean(now != then) for now, then in zip(self._compared, before or ())
                   if now.shape == then.shape]
        self._still = [(count + 1) * (not own and other > CHANGED) for count, own, other in zip(
            self._still, changed, changed[::-1])] if len(changed) == 2 else [0, 0]


def mean_confidence(match):
    """Return the mean confidence of a Match, 0 to 1."""
    # as many pixels, in rows as they lie in memory: each pair is judged by it
    return float(match.confidence[::SAMPLE_STEP**2].mean())


def share_at_the_ends(match, config, infinity):
    """Return the share of the valid disparities beyond infinity, or at the range's end, 0 to 1."""
    disparity = match.disparity[::SAMPLE_STEP, ::SAMPLE_STEP]
    last = config.min_disparity + config.disparities - LAST_LABELS
    outside = np.count_nonzero((disparity < infinity - FARTHER) | (disparity >= last))
    return outside / max(np.count_nonzero(disparity == disparity), 1)


def is_late(match, config):
    """Return whether the deadline ended the match before its first generation."""
    return (0 < config.deadline_ms < match.times['total'] and config.generations > 0
            and match.generations == 0 and not match.reused)


def is_one_picture(left, right):
    """Return whether both images, uint8 or uint16, are the same but for a conversion to grey."""
    images = [image[COMPARED].copy() for image in (left, right)]
    if left.ndim != right.ndim:
        images = [grey(image) for image in images]
    return np.count_nonzero(cv2.absdiff(*images) <= 1) >= EQUAL * images[0].size


def _first(causes, seen):
    """Return the Finding of the first cause that an `Observed` shows, None for none."""
    return next(filter(None, (cause(seen) for cause in causes)), None)


class Observed:
    """What a pair and its Match show at sight and, after `closer`, by features in common."""

    def __init__(self, left, right, match, config, scale=1.0, infinity=None, still=(0, 0)):
        """Measure what is seen at sight; arguments as for `PlausibilityCheck` and its `add`."""
        self.match, self.config, self.scale, self.infinity = match, config, scale, infinity
        self.images, self.still = _in_grey(left, right), still
        self.shares = [textured_share(image) for image in self.images]
        self.same, first = is_one_picture(left, right), config.min_disparity
        self.searched = first / scale, (first + config.disparities - 1) / scale

    def closer(self):
        """Compare features; return itself."""
        features, rows = features_in_common(*self.images), self.match.misalignment
        if rows is not None and rows.undone:
            features = features._replace(lower=features.lower - terms_at(
                *features.places.T, *self.images[0].shape) @ rows.terms)
        apart, limit = _apart(features, self.images[0].shape), TOLERANCE * features.pixel
        agree = np.abs(features.lower - apart) <= limit
        self.features, self.apart, found = features, apart[agree], features.disparities[agree]
        self.fit = np.count_nonzero(np.abs(self.apart) <= max(TOLERANCE, features.pixel / 2))
        self.disparities, self.number = found, len(found)
        pixel, first = features.pixel, self.config.min_disparity
        least = (self.infinity or 0.0) - FARTHER * pixel
        self.farther, self.nearer, *self.impossible = map(np.count_nonzero, (
            found < first - pixel, found > first + self.config.disparities - 1 + pixel,
            found < least, -found < least))
        return self


def _by_light(seen):
    brightest, darkest = zip(*(np.percentile(
        image[::SAMPLE_STEP, ::SAMPLE_STEP], (BRIGHTEST, DARKEST)) for image in seen.images))
    dark = _names([value < BLACK for value in brightest])
    if dark:
        return Finding('dark', f'the {dark} black (brightness {max(min(brightest), 0):.0f} of '
                       '255): uncover the lens, switch on a light, or expose longer')
    white = _names([value > WHITE for value in darkest])
    return white and Finding(
        'overexposed', f'the {white} white (brightness {max(darkest):.0f} of 255): expose '
        'shorter, or shade the lens')


def _by_texture(seen):
    shares = seen.shares
    if max(shares) < PLAIN:
        return Finding('plain', f'little texture: {100 * max(shares):.1f} % of the pictures have '
                       'contrast, as of a plain wall that fills them; what is matched there is '
                       'uncertain', warns=False)
    plain = _names([share < PLAIN for share in shares])
    return plain and max(shares) > TEXTURED and Finding(
        'covered', f'the {plain} without contrast ({100 * min(shares):.1f} % of it has any, '
        f'{100 * max(shares):.0f} % of the other): uncover or clean the lens, or focus it')


def _by_equality(seen):
    if seen.same:
        return Finding('same', 'left and right are one picture: correct the remapping, or the '
                       'name, of one of the two')
    frozen = [side for side, count, share in zip(
        ('left', 'right'), seen.still, seen.shares)
        if count >= CONFIRMED and share >= PLAIN]
    return frozen and Finding(
        'frozen', f'the {frozen[0]} image stays the same while the other one changes: the '
        f'{frozen[0]} camera or its driver hangs, start it again')


def _names(chosen):
    """Return which of the left and the right image are chosen, with a verb; '' for none."""
    names = [side for side, one in zip(('left', 'right'), chosen) if one]
    return ' and '.join(names) + ('', ' image is', ' images are')[len(names)]


def textured_share(image):
    """Return the share of a grey image, uint8 (R, C), that has contrast, 0 to 1."""
    small = reduced(image, REDUCED).astype(np.int16)
    steps = np.maximum(np.abs(small[1:-1, 2:] - small[1:-1, :-2]),
                       np.abs(small[2:, 1:-1] - small[:-2, 1:-1]))
    return float(np.mean(steps > CONTRAST)) if steps.size else 0.0


def _apart(features, shape):
    """Return by how much the row of each feature is expected to be lower in the right image."""
    if not len(features.lower):
        return np.zeros(0)
    middle = float(np.median(features.lower))
    surface = misalignment_of(
        [np.column_stack([features.places, features.lower - middle])], *shape)
    return middle + (0 if surface is None else terms_at(
        *features.places.T, *shape) @ surface.terms) * np.ones(len(features.lower))


def _unlike(seen):
    total, number = seen.features.number, seen.number
    unsure = UNSURE_PAPER if seen.config.algorithm == 'paper' else UNSURE
    return total > MANY and number < UNLIKE and mean_confidence(seen.match) < unsure and (
        Finding('unlike', f'the images do not show the same: {number} of {total} features of the '
                'left image are found in the right one; see that both are of one stereo camera, '
                'of one moment, and in focus'))


def _by_infinity(seen):
    (here, exchanged), number = seen.impossible, seen.number
    # Where infinity is not known, a range that includes them may be right.
    if here < max(TURNED * number, FEWEST_FEATURES) or seen.infinity is None and (
            max(seen.nearer, seen.farther) < max(FEWEST_BEYOND, BEYOND * number)):
        return None
    far, middle, near = np.percentile(seen.disparities, (10, 50, 90))
    if near - far > FLAT * seen.features.pixel and here >= OUTNUMBERED * exchanged:
        return Finding('swapped', f'left and right are swapped: of {number} features in common '
                       f'{here} are farther than infinity as the images are, {exchanged} if they '
                       'are exchanged; exchange the images and their camera_info')
    return Finding('turned', f'{100 * here / number:.0f} % of the features in common are farther '
                   f'than infinity (disparity {middle / seen.scale:.0f} px in the middle), as '
                   'if one camera had turned: see that none hangs and both expose at one moment, '
                   'or rectify, or calibrate the two as a pair; if the cameras face a flat wall, '
                   'left and right may be swapped')


def _by_rows(seen):
    if seen.number < FEWEST_FEATURES or 2 * seen.fit >= seen.number:
        return None
    low, high = np.percentile(seen.apart, (5, 95))
    where = f'{low:+.0f} to {high:+.0f} px lower' if high - low > 2 else (
        f'{abs(low + high) / 2:.0f} px {"lower" if low + high > 0 else "higher"}')
    return Finding('rows', f'the rows of the images do not fit: {seen.number} features lie '
                   f'{where} in the right image; rectify the images, or calibrate the two cameras '
                   'as a pair')


def _by_range(seen):
    number, (first, last) = seen.number, seen.searched
    if number < FEWEST_FEATURES:
        return None
    fewest = max(FEWEST_BEYOND, BEYOND * number)
    least, most = np.percentile(seen.disparities, (1, 99)) / seen.scale
    if seen.nearer >= fewest:
        return _more(
            first, most + RANGE_MARGIN - first, f'{100 * seen.nearer / number:.0f} % of the '
            f'features in common are nearer than the range reaches (up to {most:.0f} px, searched '
            f'are {first:.0f} to {last:.0f})')
    return seen.farther >= fewest and Finding(
        'range', f'{100 * seen.farther / number:.0f} % of the features in common are farther '
        f'than the range begins (from {least:.0f} px, searched are {first:.0f} to {last:.0f}): '
        f'lower min_disparity to {least - RANGE_MARGIN:.0f}', needed=(least - RANGE_MARGIN, last))


def _more(first, wanted, fault, more=''):
    needed = proposed(wanted)
    return Finding('range', f'{fault}: search {needed} disparities{more}',
                   needed=(first, first + needed - 1))


def _by_matches(seen):
    match, config, (first, last) = seen.match, seen.config, seen.searched
    if match.beyond > NEARER:
        return _more(
            first, match.needed_disparities / seen.scale, f'{100 * match.beyond:.1f} % of the '
            f'matches are nearer than the range reaches (disparity above {last:.0f}) and were '
            'rejected', ' or more')
    return is_late(match, config) and Finding(
        'deadline', f'the deadline of {config.deadline_ms:g} ms ended before the first '
        f'generation, after {match.times["total"]:.0f} ms; the result is where evolution would '
        'start: raise deadline_ms, or search fewer disparities in smaller images')


# In the order in which causes are looked for: each takes an `Observed` and returns a Finding, or
# what is false. The second ones compare features.
AT_SIGHT = _by_light, _by_texture, _by_equality
CLOSER = _unlike, _by_infinity, _by_rows, _by_range, _by_matches


def _in_grey(*images):
    """Return the images of a pair in grey, the upper 8 of the bits that they use: uint8 (R, C)."""
    images = [grey(image) for image in images]
    if images[0].dtype == np.uint8:
        return images
    brightest = np.percentile([image[::SAMPLE_STEP, ::SAMPLE_STEP] for image in images], BRIGHTEST)
    bits = max(FEWEST_BITS, int(brightest).bit_length())
    return [np.minimum(image >> (bits - 8), 255).astype(np.uint8) for image in images]
