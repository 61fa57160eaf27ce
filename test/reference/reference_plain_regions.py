# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Plain twins of the evidence of plain regions: realtime/plain_regions.py and its kernels."""
import numpy as np
from reference import windows
from reference_refinement import components

SMOOTH, SLOPE = np.array([1, 4, 6, 4, 1]), np.array([-1, -2, 0, 2, 1])
LARGEST, ROWS, COLUMNS, COUNTED = 11, 8, 16, 4


def flatness(luminance, burnt):
    """Return the largest smoothed step of each pixel, 1/64 grey level; luminance: with margin."""
    around = windows(luminance.astype(np.int64), 2)[2:-2, 2:-2]
    across, down = (abs(around @ np.outer(*kernels).ravel())
                    for kernels in ((SMOOTH, SLOPE), (SLOPE, SMOOTH)))
    steps = np.minimum(np.maximum(across, down) >> 9, 65535)
    return np.where(luminance[2:-2, 2:-2] >= burnt, 65535, steps)


def plain_mask(steps, limit):
    """Return where all of 3 x 3 pixels have steps below a limit."""
    return windows(steps, 1).max(axis=2) < limit


def regions(mask, least):
    """Return the number of each pixel's region, -1 for none, by the regions' first pixels."""
    numbers = np.full(mask.shape, -1)
    kept = [found for found in components(mask, lambda *_: True) if len(found) >= least]
    for number, places in enumerate(kept):
        numbers[tuple(np.transpose(places))] = number
    return numbers


def every_other_row(luminance):
    """Return the binomial mean of 3 x 3 pixels in every other row, a quarter: int (r, C)."""
    quarter = luminance[1:-1, 1:-1].astype(np.int64) >> 2
    across = (quarter[:, :-2] + 2 * quarter[:, 1:-1] + quarter[:, 2:]) >> 2
    return ((across[:-2] + 2 * across[1:-1] + across[2:] + 2) >> 2)[::2]


def mean_of_three(picture, mask, apart, axis):
    """Return the binomial mean of pixels `apart` along an axis, without those beyond the mask."""
    picture, total = picture.astype(np.int64), 4 * picture.astype(np.int64) + 2
    for shift in (-apart, apart):
        other, counts = np.roll(picture, shift, axis), np.roll(mask, shift, axis).astype(bool)
        edge = slice(shift, None) if shift < 0 else slice(0, shift)
        counts[(slice(None),) * axis + (edge,)] = False
        total += np.where(counts, other - picture, 0)
    return total >> 2


def bands(luminance, mask, clip):
    """Return both bands of texture, quantised: int (2, r, C); clip: called with size and count."""
    fine = every_other_row(luminance)[:len(mask)]
    medium = mean_of_three(mean_of_three(fine, mask, 2, 1), mask, 1, 0)
    coarse = mean_of_three(mean_of_three(medium, mask, 4, 1), mask, 2, 0)
    result = []
    for band in ((fine - medium) * mask, (medium - coarse) * mask):
        limit = clip(int(abs(band).sum()), int(mask.sum()))
        scale = int(2 * LARGEST * 2**15 // limit)
        size = (np.minimum(2 * abs(band), 65535) * scale >> 16) + 1 >> 1
        result.append(np.sign(band) * np.minimum(size, LARGEST))
    return np.array(result)


def vote(left, right, mask, numbers, labels):
    """
    Return the sums of products and counts of each cell: {(region, row, column): (curves, counts)}.

    left, right: int (2, r, C), the right one not mirrored; mask: of the right one; numbers: of the
    regions, (r, c)
    """
    found = {}
    for row, half in np.argwhere(numbers >= 0):
        cell = numbers[row, half], row // ROWS, 2 * half // COLUMNS
        curves, counts = found.setdefault(cell, (np.zeros((2, labels), int),
                                                 np.zeros(labels, int)))
        for column in (2 * half, 2 * half + 1):
            for label in range(min(labels, column + 1)):
                curves[:, label] += left[:, row, column] * right[:, row, column - label]
                counts[label] += bool(mask[row, column - label]) and row % COUNTED == 0
    return found


def elect(found, region, labels, nearest, groups):
    """Return what a region elects, and the shares of halves, and of both halves, that do."""
    # found: of `vote`; nearest: the lowest label that can be elected; groups: of columns of cells
    cells = [(column % groups, *votes) for (of_region, _, column), votes in found.items()
             if of_region == region]
    seen = COUNTED * sum(counts for _, _, counts in cells)
    spreads = np.sqrt(sum((curves.astype(float)**2).sum(1) for _, curves, _ in cells) / seen.sum())
    allowed = (seen > 0.3 * seen.max()) & (np.arange(labels) >= nearest)

    def best(half):
        total = sum(curves for group, curves, _ in cells if group in half)
        score = (total / spreads[:, None]).sum(0) / np.sqrt(np.maximum(seen, 1))
        return np.where(allowed, score, -np.inf).argmax()
    whole, agree = best(range(groups)), []
    for split in range(1, groups):
        both = [{group for group in range(groups) if (group & split).bit_count() % 2 == parity}
                for parity in (0, 1)]
        if all(any(group in half for group, *_ in cells) for half in both):
            agree.append([abs(best(half) - whole) <= 1 for half in both])
    return whole, np.mean(agree), np.mean([all(both) for both in agree])
