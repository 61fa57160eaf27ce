# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What both views show at the matches of a map: sums over blocks of pixels, and clipped pixels."""
from fuzzy_stereo_ros.matching.kernels.compiled import kernel
from fuzzy_stereo_ros.matching.kernels.possibility.features import MARGIN, SLACK
from fuzzy_stereo_ros.matching.kernels.units import CONSISTENT, INVALID, VOTED
import numpy as np

BLOCK = 4       # half-size pixels of a side of the blocks
DARK, BRIGHT = 1, 2     # ends at which a pixel is clipped
DARKEST, BRIGHTEST = 0, 254 * 256   # luminance up to and from which it is
SUMS = 6        # of a block: pixels, left, right, left squared, right squared, left times right


@kernel
def sum_blocks(labels, left, right, shift, sums, clipped, first, last):
    """
    Add up the luminance of both views at half size in blocks of pixels, as a map matches them.

    labels: (R, C) at full size; left, right: uint16, padded, the right one mirrored, see features;
    shift: columns to the right, at full size, by which the right one is not moved yet;
    sums: float64 (SUMS, block rows, block columns), written for the rows of blocks first to last,
    exact; clipped: uint8 (r, c), DARK, BRIGHT, both or 0, of either of the two pixels
    """
    (rows, columns), width = clipped.shape, right.shape[1] - 2 * MARGIN - SLACK
    for block_row in range(first, last):
        sums[:, block_row] = 0
        for row in range(BLOCK * block_row, min(BLOCK * (block_row + 1), rows)):
            line, other = left[row + MARGIN, MARGIN:], right[row + MARGIN, MARGIN:]
            genes, marks = labels[2 * row], clipped[row]
            for block in range(sums.shape[2]):
                lefts = rights = squares = right_squares = products = np.int64(0)
                end = min(BLOCK * (block + 1), columns)
                for column in range(BLOCK * block, end):
                    away = (np.int64(genes[2 * column]) + shift + 1) >> 1
                    pointed = min(max(columns - 1 - column + away, 0), width - 1)
                    here, there = np.int64(line[column]), np.int64(other[pointed])
                    marks[column] = (DARK * (min(here, there) <= DARKEST)
                                     | BRIGHT * (max(here, there) >= BRIGHTEST))
                    lefts += here
                    rights += there
                    squares += here * here
                    right_squares += there * there
                    products += here * there
                sums[0, block_row, block] += end - BLOCK * block
                sums[1, block_row, block] += lefts
                sums[2, block_row, block] += rights
                sums[3, block_row, block] += squares
                sums[4, block_row, block] += right_squares
                sums[5, block_row, block] += products


@kernel(allocates=True)
def reject_unseen(seen, clipped, weights, validity, first, last):
    """
    Reject the matches of some rows of which the pair shows nothing.

    seen: uint8 (block rows, block columns), not 0 where the views agree; clipped: see sum_blocks,
    of which a match is rejected whose 3 x 3 pixels are all clipped at one end; weights: uint8
    (R, C), VOTED where a whole region is the evidence; validity: uint8 (R, C), changed
    """
    rows, columns = clipped.shape
    blind = np.zeros(columns + 2, np.uint8)
    unseen = np.empty(max(validity.shape[1], 2 * columns), np.uint8)
    for row in range(first, last):
        half = min(row // 2, rows - 1)
        above, here, below = (clipped[max(half - 1, 0)], clipped[half],
                              clipped[min(half + 1, rows - 1)])
        blocks, line, of_prior = seen[half // BLOCK], validity[row], weights[row]
        for place in range(columns):
            blind[place + 1] = above[place] & here[place] & below[place]
        blind[0], blind[columns + 1] = blind[1], blind[columns]
        for place in range(columns):
            unseen[2 * place] = unseen[2 * place + 1] = (
                (blind[place] & blind[place + 1] & blind[place + 2] != 0)
                | (blocks[place // BLOCK] == 0))
        unseen[2 * columns:] = unseen[2 * columns - 1]
        for column in range(line.size):
            rejected = ((line[column] == CONSISTENT) & (of_prior[column] != VOTED)
                        & (unseen[column] != 0))
            line[column] = INVALID if rejected else line[column]
