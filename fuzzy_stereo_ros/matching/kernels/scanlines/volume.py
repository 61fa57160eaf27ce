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

from fuzzy_stereo_ros.matching.kernels.addresses import load_long
from fuzzy_stereo_ros.matching.kernels.compiled import called, inlined, kernel
from fuzzy_stereo_ros.matching.kernels.simd import LANES
import numpy as np


class Windows(NamedTuple):
    """Which labels each square tile searches, and where its costs lie in a row of pixels."""

    low: np.ndarray          # int64 (tile rows, tile columns), the first label
    blocks: np.ndarray       # int64 (tile rows, tile columns), 32 labels each
    offset: np.ndarray       # int64 (tile rows, tile columns), bytes from the start of the row
    row_size: np.ndarray     # int64 (tile rows,), bytes of a row of pixels


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
    label_bytes: int         # of the labels of priors and of what is chosen: 1 or 2
    box: int                 # 0, or costs are sums of 3 x 3 pixels / 2**box without priors
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
    half_labels: int         # the priors, see Prior
    half_weights: int
    half_table: int
    half_reach: int
    previous_labels: int
    previous_weights: int
    previous_table: int
    previous_reach: int
    tile: int                # pixels of a side
    tile_columns: int
    low: int                 # see Windows
    blocks: int
    offset: int
    row_size: int
    labels: int              # see SearchResult
    offsets: int
    sums: int
    margins: int
    target: int


class Scratch(NamedTuple):
    """Addresses of working memory, shared on to `down`: bytes, but for words of 32 bits."""

    strip: int               # bytes of a row of tiles at most
    kept: int                # rows of tiles that are kept
    path_size: int           # bytes of the path to a pixel at most, a byte a label
    row_words: int           # words of a row of pixels at most
    costs: int               # of the rows of tiles kept, each from a multiple of `strip`
    sums: int                # the same
    down: int                # downward paths to a row of pixels, `path_size` bytes each
    up: int                  # upward paths to a row of a tile
    carried: int             # paths while they are carried to other windows
    row_paths: int           # paths along up to ROWS_AT_ONCE rows, `path_size` bytes each
    labels: int              # one pixel's labels, or four pixels'
    unused_sums: int         # of a pixel, written below the rows whose labels are chosen
    raw_rows: int            # raw costs of the three rows of a box sum
    codes: int               # words: census codes and gradients of up to ROWS_AT_ONCE rows
    priors: int              # words: where the priors' tables begin, of the same rows
    jumps: int               # words: P2 of the same rows, to the left, or of one to the row above
    chosen: int              # uint16: the labels chosen for a row of a tile
    least_below: int         # sums of the labels below the best ones
    least_above: int         # and above them
    offers: int              # uint16: what the target's pixels are offered


@called
def blocks_of(labels):
    """Return how many blocks a window of so many labels has: four are faster than three."""
    blocks = (labels + LANES - 1) // LANES
    return 4 if blocks == 3 else blocks


@kernel
def place_windows(windows, columns, tile, page, shift, first, last):
    """
    Place the costs of the tiles of some rows of tiles, one behind the other in a row of pixels.

    windows: the fields of Windows, of which offset and row_size are written; columns: of the
    image; tile: pixels of a side; rows lie `shift` bytes more than some pages apart
    """
    _, blocks, offset, row_size = windows
    for tile_row in range(first, last):
        used = 0
        for tile_column in range(blocks.shape[1]):
            offset[tile_row, tile_column] = used
            width = min(tile, columns - tile_column * tile)
            used += LANES * blocks[tile_row, tile_column] * width
        row_size[tile_row] = used + (shift - used) % page


@inlined
def window_of(search, tile_row, tile):
    """Return the first label of a tile, its blocks, and where its costs lie in a row."""
    index = tile_row * search.tile_columns + tile
    return (load_long(search.low, index), load_long(search.blocks, index),
            load_long(search.offset, index))


@inlined
def columns_of(search, tile):
    """Return the first column of a tile and the one behind its last."""
    begin = tile * search.tile
    return begin, min(begin + search.tile, search.columns)


@inlined
def row_start(search, scratch, row):
    """Return where the costs of a row begin, in bytes from those of the scratch."""
    tile_row = row // search.tile
    return (tile_row % scratch.kept * scratch.strip
            + (row - tile_row * search.tile) * load_long(search.row_size, tile_row))
