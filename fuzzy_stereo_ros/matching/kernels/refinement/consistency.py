# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Which pixels to reject: inconsistent ones, speckles, and those of which nothing is seen."""
from fuzzy_stereo_ros.matching.kernels.addresses import next_byte
from fuzzy_stereo_ros.matching.kernels.compiled import called, inlined, kernel
from fuzzy_stereo_ros.matching.kernels.possibility.features import MARGIN, SLACK
from fuzzy_stereo_ros.matching.kernels.simd import (
    absolute_difference, equal_bits, first_set, LANES, load, saturating_subtract, splat,
    splat_like)
from fuzzy_stereo_ros.matching.kernels.union_find import join
from fuzzy_stereo_ros.matching.kernels.units import CONSISTENT, INVALID, OUTSIDE, VOTED
import numpy as np


@kernel
def check_consistency(labels, target, target_range, validity, first, last):
    """
    Compare the label of each pixel with that of the target pixel that it points at.

    target: uint8 (R, extra + C), labels modulo 256, from column -extra on; validity: CONSISTENT,
    OUTSIDE (points beyond the target image, cannot be checked) or INVALID
    """
    columns = labels.shape[1]
    extra = target.shape[1] - columns
    begin, end = max(target_range[0] + extra, 0), min(target_range[1] + 1 + extra, target.shape[1])
    # unsigned: one comparison tests both ends, and an index needs no test of its sign
    width = np.uint64(max(end - begin, 0))
    for row in range(first, last):
        for column in range(columns):
            label = np.int64(labels[row, column])
            pointed = column + extra - label
            if np.uint64(pointed - begin) >= width:
                validity[row, column] = OUTSIDE
                continue
            difference = (label - np.int64(target[row, np.uint64(pointed)]) + 1) & 255
            validity[row, column] = CONSISTENT if difference <= 2 else INVALID


@kernel
def compare_views(disparities, others, lowest, most, validity, first, last):
    """
    Compare each pixel with the pixel of the other view that it points at.

    disparities: px from `lowest`; others: likewise, of the mirrored other view; most: px by which
    they may differ
    """
    columns = disparities.shape[1]
    for row in range(first, last):
        for column in range(columns):
            mine = disparities[row, column]
            pointed = column - lowest - np.int64(np.rint(mine))
            if pointed < 0 or pointed >= columns:
                validity[row, column] = OUTSIDE
            elif abs(others[row, columns - 1 - pointed] - mine) <= most:
                validity[row, column] = CONSISTENT
            else:
                validity[row, column] = INVALID


@kernel
def reject_nearer(disparity, confidence, highest, counts, first, last):
    """
    Reject disparities beyond the range, and count them by distance: [within, 1 px, 2 px ...].

    disparity, confidence: float32 (R, C), px; disparities above `highest`, px, by more than half a
    pixel are rejected, the others above it become `highest`. counts: int64, increased.
    """
    for row in range(first, last):
        line, sure = disparity[row], confidence[row]
        within = nearer = np.int32(0)
        for column in range(line.size):
            within += np.int32(line[column] <= highest)
            nearer += np.int32(line[column] > highest)
        counts[0] += within
        if nearer == 0:
            continue
        for column in range(line.size):
            away = line[column] - highest
            if away > np.float32(0.5):
                counts[min(np.int64(away + np.float32(0.5)), counts.size - 1)] += 1
                line[column], sure[column] = np.nan, 0
            elif away > 0:
                counts[0] += 1
                line[column] = highest


@kernel
def reject_changed(labels, genes, validity, final_validity, first, last):
    """Copy the validity, and invalidate cells whose gene changed by more than one label."""
    for row in range(first, last):
        line, changed, valid, final = labels[row], genes[row], validity[row], final_validity[row]
        for column in range(line.size):
            away = abs(np.int32(line[column]) - np.int32(changed[column]))
            # the largest validity; LLVM 14 makes no vectors of this choice
            final[column] = max(valid[column], np.uint8(INVALID) * np.uint8(away > 1))


@called
def _near(labels, one, two, step):
    return abs(np.int64(labels[one]) - np.int64(labels[two])) <= step


@inlined
def _end_run(validity, place, open_at, begin, end, known):
    """End the run that is open before a place, if any, and open one there unless rejected."""
    if open_at >= 0:
        begin[known] = open_at
        end[known] = place
        known += 1
    return known, place if validity[place] != INVALID else np.int64(-1)


@called
def _runs_of_row(labels, validity, begin, end, first, stop, step, known):
    """
    Append the runs of a row: neighbours not rejected whose steps are at most `step`.

    Vectors find where runs end or begin; only these pixels are handled one by one.
    """
    open_at = np.int64(first) if validity[first] != INVALID else np.int64(-1)
    rejected, place = splat(np.uint8(INVALID)), first + 1
    while place + LANES <= stop:
        here = load(labels, place)
        away = absolute_difference(here, load(labels, place - 1))
        joined = equal_bits(saturating_subtract(away, splat_like(here, step)),
                            splat_like(here, 0))
        changes = (equal_bits(load(validity, place), rejected)
                   ^ equal_bits(load(validity, place - 1), rejected)) | ~joined
        while changes != 0:
            known, open_at = _end_run(validity, place + first_set(changes), open_at, begin, end,
                                      known)
            changes &= changes - np.uint32(1)
        place += LANES
    while place < stop:
        if ((validity[place] == INVALID) != (validity[place - 1] == INVALID)
                or not _near(labels, place, place - 1, step)):
            known, open_at = _end_run(validity, place, open_at, begin, end, known)
        place += 1
    if open_at >= 0:
        begin[known] = open_at
        end[known] = stop
        known += 1
    return known


@called
def _touch(labels, begin, end, columns, step):
    """Return whether some pixel of begin .. end is within step of the one above it."""
    place = begin
    while place < end and not _near(labels, place, place - columns, step):
        place += 1
    return place < end


@inlined
def _join_rows(labels, columns, step, runs, above, stop, first, last):
    """Join the runs first .. last of a row with those above, above .. stop, that they touch."""
    begin, end, parent, size = runs[0], runs[1], runs[2], runs[3]
    for run in range(first, last):
        low, high = begin[run] - columns, end[run] - columns
        while above < stop and end[above] <= low:
            above += 1
        other = above
        while other < stop and begin[other] < high:
            if _touch(labels, max(low, begin[other]) + columns, min(high, end[other]) + columns,
                      columns, step):
                kept, joined = join(parent, run, other)
                size[kept] += size[joined] if joined != kept else 0
            other += 1


@kernel
def find_components(labels, validity, step, runs, marks, first, last):
    """
    Find the components of some rows: 4-connected by steps of at most `step`, of valid pixels.

    runs: int32 (4, R * C), the first pixel of each run, the one after its last, its parent in a
    union-find, and the pixels of the component, known for its representative; those of these rows
    begin at first * C; marks: int64 (3,), where the runs of the first row end, where those of the
    last row begin, and end
    """
    columns, labels, validity = labels.shape[1], labels.reshape(-1), validity.reshape(-1)
    begin, end, parent, size = runs[0], runs[1], runs[2], runs[3]
    known = above = first * columns
    for row in range(first, last):
        begun = known
        known = _runs_of_row(labels, validity, begin, end, row * columns, (row + 1) * columns,
                             step, known)
        for run in range(begun, known):
            parent[run], size[run] = run, end[run] - begin[run]
        if row == first:
            marks[0] = known
        else:
            _join_rows(labels, columns, step, runs, above, begun, begun, known)
        above = begun
    marks[1], marks[2] = above, known


@kernel
def join_components(labels, step, runs, marks, edges):
    """Join the components of bands where they touch; edges: the first row of each band."""
    columns, labels = labels.shape[1], labels.reshape(-1)
    for band in range(1, edges.size):
        _join_rows(labels, columns, step, runs, marks[band - 1, 1], marks[band - 1, 2],
                   edges[band] * columns, marks[band, 0])


@kernel
def reject_small(validity, smallest, runs, first, last):
    """Reject the runs first .. last that belong to components of fewer than `smallest` pixels."""
    begin, end, parent, size = runs[0], runs[1], runs[2], runs[3]
    validity = validity.reshape(-1)
    for run in range(first, last):
        top = run
        while parent[top] != top:       # other threads read the same: nothing is shortened
            top = parent[top]
        if size[top] < smallest:
            validity[begin[run]:end[run]] = INVALID


BLOCK = 4       # half-size pixels of a side of the blocks
DARK, BRIGHT = 1, 2     # ends at which a pixel is clipped
GREY_LEVEL = 256    # of luminance
DARKEST, BRIGHTEST = 0, 254 * GREY_LEVEL    # luminance up to and from which it is
SUMS = 6        # of a block: left, right, left squared, right squared, left times right, pixels


@called
def _add_products(one, other, sums):
    """Add the products of two rows of luminance to sums."""
    for column in range(sums.size):
        sums[column] += np.int64(one[column]) * np.int64(other[column])


@called
def _add(one, sums):
    """Add a row of luminance to sums."""
    for column in range(sums.size):
        sums[column] += one[column]


@kernel(allocates=True)
def sum_blocks(labels, left, right, shift, sums, clipped, first, last):
    """
    Add up the luminance of both views at half size in blocks of pixels, as a map matches them.

    left, right: luminance, the right one mirrored; shift: columns to the right, at full size, by
    which the right one is not moved yet; sums: float64 (block rows, block columns, SUMS), exact;
    clipped: uint8 (r, c), DARK, BRIGHT, both or 0, of either of the two pixels; first, last: rows
    of blocks
    """
    (rows, columns), width = clipped.shape, right.shape[1] - 2 * MARGIN - SLACK
    there, of_columns = np.empty(columns, np.uint16), np.empty((SUMS - 1, columns), np.int64)
    for block_row in range(first, last):
        begin, end = BLOCK * block_row, min(BLOCK * (block_row + 1), rows)
        of_columns[:] = 0
        for row in range(begin, end):
            here, other = left[row + MARGIN, MARGIN:], right[row + MARGIN, MARGIN:]
            genes, marks = labels[2 * row], clipped[row]
            for column in range(columns):
                away = (np.int64(genes[2 * column]) + shift + 1) >> 1
                there[column] = other[min(max(columns - 1 - column + away, 0), width - 1)]
            for column in range(columns):
                marks[column] = (DARK * (min(here[column], there[column]) <= DARKEST)
                                 | BRIGHT * (max(here[column], there[column]) >= BRIGHTEST))
            _add(here, of_columns[0])
            _add(there, of_columns[1])
            _add_products(here, here, of_columns[2])
            _add_products(there, there, of_columns[3])
            _add_products(here, there, of_columns[4])
        for block in range(sums.shape[1]):
            of_block, stop = sums[block_row, block], min(BLOCK * (block + 1), columns)
            for kind in range(SUMS - 1):
                total = np.int64(0)
                for column in range(BLOCK * block, stop):
                    total += of_columns[kind, column]
                of_block[kind] = total
            of_block[SUMS - 1] = (end - begin) * (stop - BLOCK * block)


@kernel
def judge_blocks(sums, clear, correlated, seen):
    """
    Write of which blocks the two views show something, by the sums of 3 x 3 blocks around.

    sums: see sum_blocks; clear: variances, grey levels squared, above which a window of the left
    and of the right view shows a signal, and that of rounding, which each window has as well;
    correlated: correlation up to which it is noise; seen: uint8 (block rows, block columns), 0
    where nothing is
    """
    rows, columns = seen.shape
    left_clear, right_clear, rounding = clear
    for row in range(rows):
        for column in range(columns):
            lefts = rights = squares = right_squares = products = pixels = 0.0
            for near in range(max(row - 1, 0), min(row + 2, rows)):
                for beside in range(max(column - 1, 0), min(column + 2, columns)):
                    block = sums[near, beside]
                    lefts, rights = lefts + block[0], rights + block[1]
                    squares, right_squares = squares + block[2], right_squares + block[3]
                    products, pixels = products + block[4], pixels + block[5]
            scale = pixels * GREY_LEVEL**2
            left = max(squares - lefts * lefts / pixels, 0) / scale + rounding
            right = max(right_squares - rights * rights / pixels, 0) / scale + rounding
            common = (products - lefts * rights / pixels) / scale
            seen[row, column] = ((left > left_clear) & (right > right_clear)
                                 | (common > correlated * np.sqrt(left * right)))


@inlined
def _reject(validity, weights, first, last):
    """Reject the consistent matches of a part of a row, but those whose evidence is a region."""
    for column in range(first, last):
        if validity[column] == CONSISTENT and weights[column] != VOTED:
            validity[column] = INVALID


@kernel
def reject_unseen(seen, clipped, weights, validity, first, last):
    """
    Reject the matches of some rows of which the pair shows nothing.

    seen: uint8 (block rows, block columns), not 0 where the views agree; clipped: see sum_blocks,
    of which a match is rejected whose 3 x 3 pixels are all clipped at one end; weights: uint8
    (R, C), VOTED where a whole region is the evidence
    """
    (rows, columns), wide = clipped.shape, validity.shape[1]
    for row in range(first, last):
        half = min(row // 2, rows - 1)
        blocks, line, of_prior, here = (seen[half // BLOCK], validity[row], weights[row],
                                        clipped[half])
        for block in range(blocks.size):
            if blocks[block] == 0:
                _reject(line, of_prior, 2 * BLOCK * block,
                        wide if block == blocks.size - 1 else 2 * BLOCK * (block + 1))
        above, below = clipped[max(half - 1, 0)], clipped[min(half + 1, rows - 1)]
        column = next_byte(here, 0, 0, False)       # what is clipped is rare
        while column < columns:
            blind = above[column] & here[column] & below[column]
            for beside in (max(column - 1, 0), min(column + 1, columns - 1)):
                blind &= above[beside] & here[beside] & below[beside]
            if blind:
                _reject(line, of_prior, 2 * column,
                        wide if column == columns - 1 else 2 * column + 2)
            column = next_byte(here, column + 1, 0, False)
