# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Where the previous frame's best chromosome can still be trusted, judged on this frame."""
from fuzzy_stereo_ros.matching.kernels.consistency import CONSISTENT
from fuzzy_stereo_ros.matching.kernels.costs import layout_of, match_cost
from numba import njit
import numpy as np

TILE = 16        # pixels of a side of the tiles that are trusted or not


@njit(nogil=True, cache=True)
def tile_costs(features, labels, first_inside, costs, first, last):
    """
    Average the cost of a map over tiles of TILE x TILE pixels, on one pixel in eight.

    labels: (R, C); costs: float32 (tile rows, tile columns), the tile rows first .. last.
    """
    rows, columns = labels.shape
    census, target_census = features.census, features.target_census
    slopes, target_slopes = features.slopes, features.target_slopes
    layout = layout_of(features)
    for tile_row in range(first, last):
        for tile_column in range(costs.shape[1]):
            total, number = 0, 0
            for row in range(tile_row * TILE, min((tile_row + 1) * TILE, rows), 4):
                for column in range(tile_column * TILE + (row // 4) % 2,
                                    min((tile_column + 1) * TILE, columns), 2):
                    label = np.int64(labels[row, column])
                    if column - label >= first_inside:
                        total += match_cost(census, target_census, slopes, target_slopes,
                                            layout, row, column, label)
                        number += 1
            costs[tile_row, tile_column] = np.float32(total) / np.float32(max(number, 1))


@njit(nogil=True, cache=True)
def move_map(source, down, right, outside, moved, first, last):
    """Move a map (R, C) down and right; what comes from beyond its border is `outside`."""
    rows, columns = source.shape
    for row in range(first, last):
        origin = row - down
        for column in range(columns):
            inside = 0 <= origin < rows and 0 <= column - right < columns
            moved[row, column] = source[origin, column - right] if inside else outside


@njit(nogil=True, cache=True)
def move_tile_costs(costs, down, right, moved):
    """Move costs by tile, float32, by a number of pixels: linear between the tiles' centres."""
    rows, columns = costs.shape
    for row in range(rows):
        from_row = min(max(row - down / TILE, 0.0), rows - 1.0)
        above = min(int(from_row), max(rows - 2, 0))
        below, share_below = min(above + 1, rows - 1), from_row - above
        for column in range(columns):
            from_column = min(max(column - right / TILE, 0.0), columns - 1.0)
            left = min(int(from_column), max(columns - 2, 0))
            near, share_near = min(left + 1, columns - 1), from_column - left
            upper = costs[above, left] * (1 - share_near) + costs[above, near] * share_near
            lower = costs[below, left] * (1 - share_near) + costs[below, near] * share_near
            moved[row, column] = upper * (1 - share_below) + lower * share_below


@njit(nogil=True, cache=True)
def keep_unmoved_tiles(costs, moved_costs, maps, moved_maps):
    """
    Put back the tiles of a previous best that are cheaper where they were than moved.

    costs, moved_costs: float32 by tile, on this frame, the cheaper remain in moved_costs; maps,
    moved_maps: (R, C) labels and verdict each.
    """
    (labels, verdict), (moved_labels, moved_verdict) = maps, moved_maps
    rows, columns = labels.shape
    for tile_row in range(costs.shape[0]):
        top, bottom = tile_row * TILE, min((tile_row + 1) * TILE, rows)
        for tile_column in range(costs.shape[1]):
            if moved_costs[tile_row, tile_column] < costs[tile_row, tile_column]:
                continue
            begin, end = tile_column * TILE, min((tile_column + 1) * TILE, columns)
            for row in range(top, bottom):
                for column in range(begin, end):
                    moved_labels[row, column] = labels[row, column]
                    moved_verdict[row, column] = verdict[row, column]
            moved_costs[tile_row, tile_column] = costs[tile_row, tile_column]


@njit(nogil=True, cache=True)
def trusted_cells(labels, verdict, half, half_verdict, costs_now, costs_then, tolerance, distance,
                  half_labels, trusted):
    """
    Mark the half pixels where the previous best may be leant on.

    labels, verdict: (R, C), the previous best and whether it was consistent then; half,
    half_verdict: (r, c), this frame's half map; costs_now, costs_then: mean costs by tile on this
    frame and on its own; half_labels: (r, c), the previous best on the half grid; trusted: uint8
    (r, c). Trusted is what was consistent, does not cost `tolerance` more than it did, and is
    within `distance` of what the half map says, where that says anything.
    """
    rows, columns = half.shape
    for row in range(rows):
        for column in range(columns):
            label = np.int64(labels[2 * row, 2 * column])
            half_labels[row, column] = label
            tile_row, tile_column = 2 * row // TILE, 2 * column // TILE
            dear = (costs_now[tile_row, tile_column]
                    > costs_then[tile_row, tile_column] + np.float32(tolerance))
            denied = (half_verdict[row, column] == CONSISTENT
                      and abs(2 * np.int64(half[row, column]) - label) > distance)
            trusted[row, column] = (verdict[2 * row, 2 * column] == CONSISTENT
                                    and not dear and not denied)


@njit(nogil=True, cache=True)
def lean_on_previous(trusted, smooth, weights, first, last):
    """Spread the trust to full size: weight 1 where trusted and flat; both uint8 (r, c)."""
    rows, columns = trusted.shape
    for row in range(first, last):
        source = min(row // 2, rows - 1)
        for column in range(weights.shape[1]):
            near = min(column // 2, columns - 1)
            weights[row, column] = trusted[source, near] & smooth[source, near]
