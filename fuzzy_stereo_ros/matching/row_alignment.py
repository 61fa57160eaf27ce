# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Undo the offset between the rows of a pair, as it is measured from pair to pair.

Not in the paper, whose pairs are rectified exactly: a rig that was knocked or has warmed up gives
others. Features tell the offset of the first pair before it is matched, and again where
confidence falls; corners with a confident disparity refine it every few pairs. The right image is
read at the rows of the left one; the disparity stays that of the left image.
"""
from typing import NamedTuple

import cv2
from fuzzy_stereo_ros.matching.bands import cut_bands
from fuzzy_stereo_ros.matching.kernels.possibility.row_alignment import shift_rows
from fuzzy_stereo_ros.matching.plausibility import CONFIRMED, mean_confidence, MEMORY
from fuzzy_stereo_ros.matching.row_offsets import (
    CERTAIN, corner_offsets, feature_offsets, FEWEST, misalignment_of, normalised, PAIRS_OF_SWING,
    PLACES, reduced, terms_at)
import numpy as np

# px of significant offset from which rows are moved; up to which they are left so, or moved back
LEAST_OFFSET, LEAST_CHANGE = 0.1, 0.05
LEAST_DOUBT = 0.05  # px of standard deviation below which an offset is sure
PERIOD, FIRST = 32, 8       # pairs between two measurements; first pairs that are all measured
PAIRS = 16          # newest measured pairs that are used
NEWEST = 3          # measured pairs that together show a knock
KNOCK = 0.5         # px by which these significantly differ from those before them
LONGEST_PAUSE = 512     # pairs between two searches for features where these are few
BLOCK_SIDE, UNIQUE = 7, 10  # block matching that confirms features: px of a side, % of margin
STRIP, EVERY, ENOUGH = 16, 3, 25_000    # rows; one strip of at most so many is matched; pixels
HIDDEN = 1.5        # px beyond the right image from which a row is not matched
LOWER = 0.85        # share of the usual confidence, below which rows may have changed
FEWER = 0.99        # least share of the matches with the new rows, relative to the old ones


class Rows(NamedTuple):
    """
    The measurements of the row offset of a rig, and the offset that is undone.

    points: float32 (N, 4), column, row and offset of `row_offsets`, and the number of the measured
    pair, from 0. undone: float64 (4,), the terms that are undone, px. pair: number of the next
    pair. search: number of the pair in which features are searched next; pause: pairs from a
    search that finds too few to the next. rig: of `rig_of`. usual: mean confidence; low: newest
    pairs in a row that have less than LOWER of it.
    """

    points: np.ndarray = np.zeros((0, 4), np.float32)
    undone: np.ndarray = np.zeros(4)
    pair: int = 0
    search: int = 0
    pause: int = PERIOD
    rig: tuple = ()
    usual: float = 0.0
    low: int = 0

    def of(self, rig):
        """Return the Rows of a rig: those of the other image as reference, or new ones."""
        if rig == self.rig:
            return self
        if rig[1:] != self.rig[1:]:
            return Rows(rig=rig)
        points, columns = self.points.copy(), rig[2]
        points[:, 0], points[:, 2] = columns - 1 - points[:, 0], -points[:, 2]
        return self._replace(rig=rig, points=points, undone=self.undone * (-1, 1, -1, 1))

    def measured(self, shape):
        """Return the Misalignment of images of a shape (rows, columns), None if it is unknown."""
        return self._measured(self._by_pair(), shape)

    def with_points(self, points, shape):
        """Return Rows with the points of a further pair, float64 (N, 3), of images of a shape."""
        if not len(points):
            return self
        pairs = [*self._by_pair(), points.astype(np.float32)][-PAIRS:]
        if len(pairs) >= NEWEST + PAIRS_OF_SWING:
            newest, before = (self._measured(some, shape) for some in (
                pairs[-NEWEST:], pairs[:-NEWEST]))
            if newest and before and before.swing is not None and newest.deviation(
                    before.terms) > KNOCK + CERTAIN * before.swing:
                pairs = pairs[-NEWEST:]
        return self._replace(points=np.concatenate([
            np.column_stack([one, np.full(len(one), number, np.float32)])
            for number, one in enumerate(pairs)]))

    def _by_pair(self):
        return np.split(self.points[:, :3], np.flatnonzero(np.diff(self.points[:, 3])) + 1)

    @staticmethod
    def _measured(pairs, shape):
        return misalignment_of([one.astype(float) for one in pairs], *shape) if pairs else None


class RowAlignment:
    """Aligns the right images of pairs of one size, and measures how they lie."""

    def __init__(self, config):
        """config: a MatcherConfig; its range and `align_rows` count."""
        self._lowest, self._disparities = config.min_disparity, config.disparities
        self._undoes, self._moved, self._moved_by = config.align_rows, None, None
        self._fitted, self._seen, self._steady = (None, None), *((None, None, None),) * 2

    def align(self, pool, rows, left, right, rig):
        """
        Return right at the rows of left, which the next pair overwrites, and the `Rows` with it.

        pool: a ThreadPool; rows: the Rows after the pair before; left, right: uint8 or uint16,
        (R, C) or (R, C, 3) BGR, of one size and dtype; rig: of `rig_of`
        """
        self._moved_by = None
        rows = self._stepped(rows.of(rig), left.shape[:2])      # by this configuration
        if rows.pair == rows.search:
            rows = self._searched(pool, rows, left, right)
        return self._shifted(pool, right, rows.undone), rows

    def measured(self, rows, shape):
        """Return the Misalignment of Rows and a shape (rows, columns), None if it is unknown."""
        if rows.points is not self._fitted[0]:
            self._fitted = rows.points, rows.measured(shape)
        return self._fitted[1]

    def watch(self, rows, left, right, match):
        """
        Return the `Rows` for the next pair; corners of some pairs are measured.

        rows: of `align`; left, right: the images as they came, as for `align`; match: their Match
        """
        pair, shape, confidence = rows.pair, match.disparity.shape, mean_confidence(match)
        low = rows.low + 1 if confidence < LOWER * rows.usual else 0
        rows = rows._replace(low=low, usual=rows.usual + (
            MEMORY if rows.usual else 1) * (confidence - rows.usual))
        due = pair % PERIOD == 0 or pair < FIRST or pair < PERIOD and pair & (pair - 1) == 0
        if due and not (pair == 0 and self._is_sure(rows, shape)):
            found = corner_offsets(normalised(left), normalised(right), match.disparity,
                                   match.confidence, rows.undone)
            rows = self._stepped(rows.with_points(found, shape), shape)
            if len(found) >= FEWEST[0]:
                rows = rows._replace(pause=PERIOD)
            elif rows.search <= pair:
                rows = rows._replace(search=pair + rows.pause,
                                     pause=min(2 * rows.pause, LONGEST_PAUSE))
        if low % CONFIRMED == 0 and (low // CONFIRMED).bit_count() == 1:    # after 5, 10, 20 ...
            rows = rows._replace(search=pair + 1)
        return rows._replace(pair=pair + 1)

    def _is_sure(self, rows, shape):
        measured = self.measured(rows, shape)
        return measured is not None and measured.doubts_at_places.max() < LEAST_DOUBT

    def _searched(self, pool, rows, left, right):
        """Return the Rows with the offset of features, if block matching confirms it."""
        shape = left.shape[:2]
        images = pool.mapped(normalised, (left, right))
        found = feature_offsets(*images, self._lowest, self._disparities, pool.mapped)
        alone = Rows().with_points(found, shape)
        known, measured = self.measured(rows, shape), self.measured(alone, shape)
        if measured is None or not self._confirmed(pool, right, images, rows.undone, measured):
            return rows
        if not len(rows.points) or known is not None and measured.deviation(known.terms) > KNOCK:
            rows = rows._replace(points=alone.points)
        else:
            rows = rows.with_points(found, shape)
        return self._stepped(rows, shape)

    def _stepped(self, rows, shape):
        """Return the Rows that undo the measured offset, if it differs, and none surely small."""
        points, undone, size = self._steady     # most pairs: nothing new was measured
        if rows.points is not points or rows.undone is not undone or shape != size:
            stepped = self._undoing(rows, shape)
            if stepped is not rows:
                return stepped
            self._steady = rows.points, rows.undone, shape
        return rows

    def _undoing(self, rows, shape):
        """Return what `_stepped` does, of Rows whose offset may have been measured since."""
        measured = self.measured(rows, shape)
        if not self._undoes or (
                self._is_sure(rows, shape) and measured.deviation(0) <= LEAST_CHANGE):
            return rows._replace(undone=np.zeros(4)) if rows.undone.any() else rows
        if measured is None or (
                measured.deviation(rows.undone)
                <= (LEAST_CHANGE if rows.undone.any() else LEAST_OFFSET)):
            return rows
        terms = measured.terms
        return rows._replace(undone=terms * (np.abs(PLACES @ terms).max() > LEAST_OFFSET))

    def _confirmed(self, pool, right, images, undone, measured):
        """
        Return whether half-size images match as well with a Misalignment undone as before.

        right: as it came; images: the pair, `normalised`
        """
        if measured.deviation(undone) <= LEAST_OFFSET:
            return True
        left, lowest = _strips(reduced(images[0], 2)), self._lowest // 2

        def matched(image):
            matcher = cv2.StereoBM_create(-(-self._disparities // 32) * 16, BLOCK_SIDE)
            matcher.setMinDisparity(lowest)
            matcher.setUniquenessRatio(UNIQUE)
            matcher.setDisp12MaxDiff(1)
            found = matcher.compute(left, _strips(reduced(image, 2)))
            return np.count_nonzero(found >= 16 * lowest)
        fewer, more = pool.mapped(matched, [
            normalised(self._shifted(pool, right, terms)) if terms.any() else images[1]
            for terms in (undone, measured.terms)])
        return more >= FEWER * fewer

    def _shifted(self, pool, image, terms):
        """Return the right image at rows that differ by terms, as it is for none of them."""
        if not terms.any():
            return image
        if self._moved_by is not None and np.array_equal(terms, self._moved_by):
            return self._moved
        if self._moved is None or (self._moved.shape, self._moved.dtype) != (
                image.shape, image.dtype):
            self._moved = np.empty_like(image)
        rows, channels = len(image), image.shape[2] if image.ndim == 3 else 1
        source, moved = image.reshape(rows, -1), self._moved.reshape(rows, -1)
        largest = np.float32(np.iinfo(image.dtype).max)
        pool.each(lambda band: shift_rows(source, channels, terms, largest, moved, *band[1:]),
                  cut_bands(rows))
        self._moved_by = terms
        return self._moved

    def nearest_seen(self, rows, shape):
        """Return the outer rows, and the nearest that right has, int64 (n, C): see HIDDEN."""
        if rows.undone is not self._seen[0] or shape != self._seen[1]:
            self._seen = rows.undone, shape, self._nearest_seen(rows, *shape)
        return self._seen[2]

    @staticmethod
    def _nearest_seen(rows, height, width):
        reach = int(np.abs(PLACES @ rows.undone).max())
        if not reach:
            return slice(0, 0), np.zeros((0, width), int)
        index = np.unique(np.r_[:min(reach, height), max(height - reach, 0):height])
        column, row = np.meshgrid(np.arange(width, dtype=float), index.astype(float))
        read = row + (terms_at(column.ravel(), row.ravel(), height, width) @ rows.undone).reshape(
            row.shape)
        first = np.count_nonzero(read < -HIDDEN, axis=0)
        last = height - 1 - np.count_nonzero(read > height - 1 + HIDDEN, axis=0)
        return index, np.clip(index[:, None], first, last)


def _strips(image):
    """Return strips of rows of an image, one below the other: a share that is enough to count."""
    every = min(max(image.size // ENOUGH, 1), EVERY)
    return image[np.arange(len(image)) // STRIP % every == every // 2]


def rig_of(image, camera, reference='left'):
    """Return what tells a rig: reference, rows, columns, and numbers of its `Camera`, or None."""
    return (reference, *image.shape[:2], *(() if camera is None else map(float, camera[:5])))
