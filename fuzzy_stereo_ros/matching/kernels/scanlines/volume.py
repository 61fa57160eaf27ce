# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
What a search works on, and where its costs lie meanwhile.

Costs and sums are not kept for the whole image: a search works on a few rows of tiles at a time
and keeps only those that it still needs, so that they stay in the processor's cache. Its kernels
get addresses, not arrays, of which each would cost compile time in every kernel; the object that
calls them keeps the arrays alive.
"""
from typing import NamedTuple

from fuzzy_stereo_ros.matching.kernels.compiled import called, inlined
from fuzzy_stereo_ros.matching.kernels.simd import LANES
import numpy as np


class Penalties(NamedTuple):
    """What changes of disparity cost."""

    small: int               # P1, a change by one
    across: np.ndarray       # uint8 (R, C), P2 to the left neighbour
    down: np.ndarray         # uint8 (R, C), P2 to the upper neighbour


class SearchResult(NamedTuple):
    """The result of a search."""

    labels: np.ndarray       # uint8 or uint16 (R, C)
    offsets: np.ndarray      # int8 (R, C), 1/16 px
    sums: np.ndarray         # uint8 (R, C), summed cost of the label
    margins: np.ndarray      # uint8 (R, C), how much worse the best label elsewhere is
    target: np.ndarray       # uint8 (R, extra + C), the target's labels modulo 256


class Search(NamedTuple):
    """A search; fields other than sizes and constants of the model are addresses."""

    rows: int
    columns: int
    disparities: int
    blocks: int              # of 32 labels, all that are searched
    label_bytes: int         # of what is chosen: 1 or 2
    box: int                 # costs are sums of 3 x 3 pixels / 2**box
    near_weight: int         # how often the nearest eight neighbours of the census count
    census_cut: int
    slope_cut: int
    small: int               # P1
    across: int              # P2, see Penalties
    down: int
    census: int              # what costs are made of, see Features
    slopes: int
    target_census: int
    target_slopes: int
    census_stride: int
    slope_stride: int
    target_stride: int
    target_columns: int      # extra + C
    tile: int                # pixels of a side
    row_size: int            # bytes of a row of costs
    labels: int              # see SearchResult
    offsets: int
    sums: int
    margins: int
    target: int


class Scratch(NamedTuple):
    """Addresses of working memory, shared on to `down`: bytes, but for words of 32 bits."""

    kept: int                # rows of tiles that are kept
    path_size: int           # bytes of the path to a pixel, a byte a label
    row_words: int           # words of a row of pixels at most
    costs: int               # of the rows of tiles kept
    sums: int                # the same
    down: int                # downward paths to a row of pixels, `path_size` bytes each
    up: int                  # upward paths to a row of a tile
    row_paths: int           # paths along up to ROWS_AT_ONCE rows, `path_size` bytes each
    labels: int              # those of four pixels
    unused_sums: int         # of a pixel, written below the rows whose labels are chosen
    raw_rows: int            # raw costs of the three rows of a box sum
    codes: int               # words: census codes and gradients of a row
    jumps: int               # words: P2 of ROWS_AT_ONCE rows to the left, or of one upwards
    chosen: int              # uint16: the labels chosen for a row of a tile
    least_below: int         # sums of the labels below the best ones
    least_above: int         # and above them
    offers: int              # uint16: what the target's pixels are offered


@called
def blocks_of(labels):
    """Return how many blocks a window of so many labels has: four are faster than three."""
    blocks = (labels + LANES - 1) // LANES
    return 4 if blocks == 3 else blocks


@inlined
def columns_of(search, tile):
    """Return the first column of a tile and the one behind its last."""
    begin = tile * search.tile
    return begin, min(begin + search.tile, search.columns)


@inlined
def row_start(search, scratch, row):
    """Return where the costs of a row begin, in bytes from those of the scratch."""
    return row % (scratch.kept * search.tile) * search.row_size
