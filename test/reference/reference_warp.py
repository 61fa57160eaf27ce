# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Plain twins of what moves a map or a population by the motion of the camera, cell by cell."""
import numpy as np
from reference_search import doubled


def seen_from(view, column, row, disparity):
    """Return column, row and scale of a point in the other frame; None where it is behind."""
    across, down, scale = np.reshape(view, (3, 4)) @ (column, row, 1.0, disparity)
    return None if scale < 0.05 else (across / scale, down / scale, scale)


def move_labels(labels, lowest, view):
    """Return labels where the other frame sees them, -1 for none, and the cells they were."""
    rows, columns = labels.shape
    moved, source = np.full(labels.shape, -1, np.float32), np.full(labels.shape, -1, np.int32)
    for row, column in np.ndindex(labels.shape):
        disparity = float(labels[row, column]) + lowest
        seen = None if disparity < 0.3 else seen_from(view, column, row, disparity)
        if seen is None:
            continue
        across, down, scale = seen
        label = np.float32(disparity / scale - lowest)
        reach = min(max(1 / scale, 1), 3) / 2
        for place in np.ndindex(labels.shape):
            if (abs(place[0] - down) <= reach and abs(place[1] - across) <= reach
                    and -1 < across < columns and -1 < down < rows
                    and label >= 0 and label > moved[place]):
                moved[place], source[place] = label, row * columns + column
    return moved, source


def census_distances(moved, half, near, lowest, view, now, before):
    """Return the distances of the moved labels and of the half map's: (2, r, c)."""
    def distance(label, row, column):
        seen = seen_from(view, column, row, float(label) + lowest)
        if seen is None:
            return 12
        there, here = (int(np.floor(value + 0.5)) for value in seen[:2])
        if not (0 <= there < before.shape[1] and 0 <= here < before.shape[0]):
            return 12
        return bin(int(now[2 * row, 2 * column] ^ before[here, there])).count('1')

    found = np.full((2, *moved.shape), 12, np.uint8)
    for row, column in np.ndindex(moved.shape):
        label, other = moved[row, column], 2 * half[row, column] + 0.5
        if label >= 0:
            found[0, row, column] = distance(label, row, column)
            found[1, row, column] = found[0, row, column] if abs(other - label) <= near else (
                distance(other, row, column))
    return found


def trusted_moved(moved, source, before, distances, half, half_distances, rules):
    """Return how much the search may lean on each cell."""
    most, near, likelier, flat = rules
    found = np.zeros(moved.shape, np.uint8)
    for row, column in np.ndindex(moved.shape):
        around = moved[max(row - 1, 0):row + 2, max(column - 1, 0):column + 2]
        around = np.append(around[around >= 0], moved[row, column])
        then = divmod(max(source[row, column], 0), moved.shape[1])
        agrees = abs(2.0 * half[row, column] + 0.5 - moved[row, column]) <= near
        better = int(distances[row, column]) + likelier <= int(half_distances[row, column])
        if (source[row, column] >= 0 and distances[row, column] <= most
                and (agrees or better)
                and around.max() - around.min() <= flat):
            found[row, column] = before[then]
    return found


def moved_prior(moved, moved_weights, highest, known, weights):
    """Return labels and weights at full size."""
    moved, moved_weights = (doubled(cells, known.shape) for cells in (moved, moved_weights))
    moves = (weights == 0) & (moved_weights > 0)
    labels = np.where(moves, np.minimum(np.floor(moved + 0.5), highest), known)
    return labels, np.where(moves, moved_weights, weights)


def note_survivors(labels, moved, moved_weights, source, survived):
    """Return how many frames the labels of cells survived."""
    stayed = (moved_weights > 0) & (abs(labels - moved) <= 1)
    return np.where(stayed, np.minimum(
        survived.ravel()[source].astype(int) + 1, 255), 0)


def to_right(moved, shift):
    """Return the labels where the right image sees them, -1 for none."""
    seen = np.full_like(moved, -1)
    for row, column in np.ndindex(moved.shape):
        place = column - 0.5 * (moved[row, column] + shift)
        for cell in {int(np.floor(place)), int(np.ceil(place))} & set(range(moved.shape[1])):
            if moved[row, column] >= 0:
                seen[row, cell] = max(seen[row, cell], moved[row, column])
    return seen


def look_back(labels, lowest, view, shift, of_right):
    """Return the column and the row of each point in the frame before: (2, r, c)."""
    found = np.full((2, *labels.shape), -10.0)
    for row, column in np.ndindex(labels.shape):
        label = float(labels[row, column])
        if label < 0:
            continue
        place = column + (label + shift) / 2 if of_right else column
        seen = seen_from(view, place, row, label + lowest)
        if seen is not None:
            away = (label + lowest) / seen[2] - lowest + shift if of_right else 0
            found[:, row, column] = seen[0] - away, seen[1]
    return found


def origins_of_tiles(choices, down, right, shape):
    """Return where each cell was: row * C + column, -1 where it was not seen."""
    origins = np.full(shape, -1)
    for row, column in np.ndindex(shape):
        choice = choices[row // 16, column // 16]
        then = (row, column) if choice == 0 else (row - down, column - right)
        if choice >= 0 and 0 <= then[0] < shape[0] and 0 <= then[1] < shape[1]:
            origins[row, column] = np.ravel_multi_index(then, shape)
    return origins


def inherit(before, origins, lowest, scale, highest, fresh):
    """Return the genes of cells by those of where they were."""
    genes = fresh.copy()
    for place in np.ndindex(origins.shape):
        if origins[place] >= 0:
            row, column = np.unravel_index(origins[place], origins.shape)
            disparity = float(before[row, column]) + lowest
            nearer = max(np.dot(scale, (column, row, 1, disparity)), 0.05)
            moved = disparity / nearer - lowest
            whole = genes.dtype != np.float32
            genes[place] = np.clip(np.floor(moved + 0.5) if whole else moved, 0, highest)
    return genes
