# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Warp a map by the motion of the camera, compare the census of a point in two frames, inherit genes.

Maps lie on the half grid: cell (r, c) is the pixel (2 r, 2 c). A matrix P (3, 4) is a tuple of 12
numbers: P (column, row, 1, d) = s (column', row', 1) of the other frame, and d' = d / s. Labels
are disparities minus `lowest`. A motion is such a matrix, and the lowest, px.
"""
from fuzzy_stereo_ros.matching.kernels.compiled import inlined, kernel
from fuzzy_stereo_ros.matching.kernels.rows import copy_row
from fuzzy_stereo_ros.matching.kernels.simd import count_bits_of_word
from fuzzy_stereo_ros.matching.kernels.temporal.change_detection import TILE
import numpy as np

NO_LABEL = -1.0     # label of a cell that nothing moved to
UNSEEN = 12         # census distance to a place outside the image: that of unrelated pixels
FARTHEST = 0.3      # px of disparity; points with less are not moved
WIDEST = 3.0        # cells that a moved cell covers at the most, in each direction
NEW = -1            # origin of a cell that the previous frame did not show
OUTSIDE_IMAGE = -10.0   # column or row of a pixel that it did not show
BEHIND = 0.05       # least new distance of a point, as a share of its old one
CENSUS_SIDE = 3     # cells of a side of the square in which distances of census are summed
# largest sum of distances of a trusted moved label: less than by chance, 12 bits a cell
UNLIKE = 10 * CENSUS_SIDE**2
LIKELIER = 4        # by which its sum must be below that of the half map where they differ
AGREEING, FLAT = 3, 3   # labels by which they may differ; largest range of labels in 3 x 3 cells


@inlined
def _product(line, column, row, disparity):
    """Return the product of a line of the matrix, four numbers, with a point."""
    return line[0] * column + (line[1] * row + line[2]) + line[3] * disparity


@inlined
def _seen_from(matrix, column, row, disparity):
    """Return column and row of a point in the other frame, and 1 / scale; 0 where it is behind."""
    scale = _product(matrix[8:], column, row, disparity)
    nearness = 1 / scale if scale >= BEHIND else 0.0
    return (_product(matrix[:4], column, row, disparity) * nearness,
            _product(matrix[4:8], column, row, disparity) * nearness, nearness)


@kernel
def move_labels(labels, motion, moved):
    """
    Move each cell to its place in the other frame; where several meet, the nearest one stays.

    labels: float32 (r, c); motion: from cells to cells; moved: written, with NO_LABEL where no
    cell moved to
    """
    matrix, lowest = motion
    found, source = moved
    rows, columns = labels.shape
    found[:] = NO_LABEL
    source[:] = -1
    for row in range(rows):
        for column in range(columns):
            disparity = np.float64(labels[row, column]) + lowest
            if disparity < FARTHEST:
                continue
            across, down, nearness = _seen_from(matrix, column, row, disparity)
            if nearness == 0.0 or not (-1 < across < columns and -1 < down < rows):
                continue
            label = np.float32(disparity * nearness - lowest)
            reach = 0.5 * min(max(nearness, 1.0), WIDEST)
            for below in range(max(int(np.ceil(down - reach)), 0),
                               min(int(np.floor(down + reach)), rows - 1) + 1):
                for right in range(max(int(np.ceil(across - reach)), 0),
                                   min(int(np.floor(across + reach)), columns - 1) + 1):
                    if label > found[below, right] and label >= 0:
                        found[below, right] = label
                        source[below, right] = row * columns + column


@kernel
def pack_census(census, packed, first, last):
    """Write census, uint8 (R, 3, C or more), as words: uint32 (R, C), the rows first .. last."""
    for row in range(first, last):
        one, two, three, line = census[row, 0], census[row, 1], census[row, 2], packed[row]
        for column in range(packed.shape[1]):
            line[column] = (np.uint32(one[column]) << np.uint32(16)
                            | np.uint32(two[column]) << np.uint32(8) | np.uint32(three[column]))


@inlined
def _place_before(label, motion, row, column, rows, columns):
    """Return the pixel, row * columns + column, that showed the point of a cell; or -1."""
    matrix, lowest = motion
    across, down, nearness = _seen_from(matrix, column, row, np.float64(label) + lowest)
    inside = (nearness > 0.0) & (across > -0.5) & (across < columns - 0.5) & (down > -0.5) & (
        down < rows - 0.5)
    return np.int64(down + 0.5) * columns + np.int64(across + 0.5) if inside else np.int64(-1)


@kernel
def census_distances(moved, half, motion, census, distances, first, last):
    """
    Write the census distance between each cell and the place of its point in the previous frame.

    The place is computed as if the point stood still. moved: float32 (r, c), moved labels; half:
    (r, c), labels of the half map; motion: from cells now to pixels before; census: now and
    before, uint32 (R, C), of pack_census; distances: uint8 (2, r, c), by the moved label, and by
    that of the half map, of which near ones count as equal.
    """
    (now, before), (rows, columns) = census, census[1].shape
    then = before.reshape(-1)       # an array handed to an inlined function is counted each time
    for row in range(first, last):
        for column in range(moved.shape[1]):
            label = moved[row, column]
            found = other = np.int64(UNSEEN)
            if label >= 0:
                here = now[2 * row, 2 * column]
                place = _place_before(label, motion, row, column, rows, columns)
                if place >= 0:
                    found = count_bits_of_word(here ^ then[place])
                seen = np.float32(2 * np.int32(half[row, column])) + np.float32(0.5)
                other = found
                if abs(seen - label) > AGREEING:
                    place = _place_before(seen, motion, row, column, rows, columns)
                    other = count_bits_of_word(here ^ then[place]) if place >= 0 else np.int64(
                        UNSEEN)
            distances[0, row, column], distances[1, row, column] = found, other


@kernel(allocates=True)
def trusted_moved(moved, before, half, distances, weights, first, last):
    """
    Write the weight of the moved map in the prior of each cell: 0, or that of where it came from.

    before: uint8 (r, c), weights of the cells of the previous frame; half: (r, c), labels of the
    half map; distances: uint16 (2, r, c), summed, of the moved map and of the half map; weights:
    uint8 (r, c), written.
    """
    (labels, source), flat = moved, before.reshape(-1)
    rows, columns = labels.shape
    low = np.full(columns + 2, np.inf, np.float32)
    high = np.full(columns + 2, NO_LABEL, np.float32)
    for row in range(first, last):
        above, here, below = labels[max(row - 1, 0)], labels[row], labels[min(row + 1, rows - 1)]
        for column in range(columns):
            low[column + 1] = min(_or_far(above[column]), _or_far(here[column]),
                                  _or_far(below[column]))
            high[column + 1] = max(above[column], here[column], below[column])
        for column in range(columns):
            weights[row, column] = 0
            cell, label = np.int64(source[row, column]), here[column]
            if cell < 0 or distances[0, row, column] > UNLIKE:
                continue
            seen = np.float32(2 * np.int32(half[row, column])) + np.float32(0.5)
            if (abs(seen - label) > AGREEING
                    and distances[0, row, column] + LIKELIER > distances[1, row, column]):
                continue
            least = min(low[column], low[column + 1], low[column + 2])
            largest = max(high[column], high[column + 1], high[column + 2])
            if largest - least <= FLAT:
                weights[row, column] = flat[cell]


@inlined
def _or_far(label):
    """Return a label, or a number above all labels for NO_LABEL."""
    return label if label >= 0 else np.float32(np.inf)


@kernel(allocates=True)
def moved_prior(moved, highest, known, weights, labels, first, last):
    """
    Spread the moved map to full size, where there is no prior yet.

    moved: float32 (r, c), labels, and uint8 (r, c), their weights; highest: the last label; known:
    (R, C), labels that the weights belong to; weights: uint8 (R, C), 0 where there is none,
    written; labels: (R, C), written; first, last: half rows.
    """
    moved_labels, moved_weights = moved
    rows, columns = moved_labels.shape
    near, weight = np.empty(columns, labels.dtype), np.empty(columns, np.uint8)
    for row in range(first, last):
        for column in range(columns):
            weight[column] = moved_weights[row, column]
            near[column] = min(np.int32(moved_labels[row, column] + np.float32(0.5)), highest)
        for full in range(2 * row, labels.shape[0] if row == rows - 1 else 2 * row + 2):
            line, weight_line, known_line = labels[full], weights[full], known[full]
            copy_row(known_line, line)
            for column in range(columns):
                for place in (2 * column, 2 * column + 1):
                    free = weight_line[place] == 0
                    line[place] = near[column] if free else line[place]
                    weight_line[place] = weight[column] if free else weight_line[place]


@kernel
def note_survivors(labels, moved, weights, survived, survived_now, first, last):
    """
    Write how many frames the labels of this frame, on the half grid, survived.

    labels: float32 (r, c); weights: of trusted_moved; survived: uint8 (r, c), of the frame before;
    survived_now: uint8 (r, c), 0 where the search did not rely on the moved label, or chose
    another.
    """
    (moved_labels, source), flat_survived = moved, survived.reshape(-1)
    for row in range(first, last):
        for column in range(labels.shape[1]):
            age = np.int64(0)
            if (weights[row, column] > 0
                    and abs(labels[row, column] - moved_labels[row, column]) <= 1):
                age = min(np.int64(flat_survived[np.int64(source[row, column])]) + 1, 255)
            survived_now[row, column] = age


@kernel
def to_right(moved, shift, seen):
    """
    Move labels (r, c) to their place in the right image; where several meet, the nearest stays.

    shift: labels that the columns of the right image are moved by; seen: float32 (r, c), NO_LABEL
    where none came to.
    """
    rows, columns = moved.shape
    seen[:] = NO_LABEL
    for row in range(rows):
        for column in range(columns):
            label = moved[row, column]
            if label < 0:
                continue
            place = column - 0.5 * (label + shift)
            for cell in range(max(int(np.floor(place)), 0),
                              min(int(np.ceil(place)), columns - 1) + 1):
                seen[row, cell] = max(seen[row, cell], label)


@kernel
def look_back(labels, motion, shift, of_right, places, first, last):
    """
    Write the pixel of the previous frame that showed the point at each cell's centre.

    labels: float32 (r, c), as the left or the right image sees them; motion: from centres of cells
    of the left image to its pixels before; shift: as of to_right;
    places: float32 (2, r, c), columns and rows, px, outside the image where it is not known.
    """
    matrix, lowest = motion
    for row in range(first, last):
        for column in range(labels.shape[1]):
            places[:, row, column] = OUTSIDE_IMAGE
            label = np.float64(labels[row, column])
            if label < 0:
                continue
            place = column + (0.5 * (label + shift) if of_right else 0.0)
            there, here, nearness = _seen_from(matrix, place, row, label + lowest)
            if nearness > 0.0:
                if of_right:
                    there -= (label + lowest) * nearness - lowest + shift
                places[0, row, column], places[1, row, column] = there, here


@kernel
def origins_of_tiles(choices, down, right, origins):
    """
    Write where each cell was, row * columns + column, or NEW.

    choices: 1 where a tile moved down and to the right; origins: int32 (R, C)
    """
    rows, columns = origins.shape
    for row in range(rows):
        for column in range(columns):
            choice = choices[row // TILE, column // TILE]
            then = row - down if choice > 0 else row
            place = column - right if choice > 0 else column
            inside = choice >= 0 and 0 <= then < rows and 0 <= place < columns
            origins[row, column] = then * columns + place if inside else NEW


@kernel
def inherit(before, origins, lowest, scale, highest, fresh, genes):
    """
    Write a chromosome: the genes of the previous one where they were, new ones elsewhere.

    before: uint16 or float32 (R, C); origins: int32 (R, C); lowest: px, the disparity of gene 0;
    scale: (a, b, c, d), the disparity of a point becomes that by a * column + b * row + c + d *
    disparity; highest: the last gene; fresh: (R, C), genes of NEW cells; genes: (R, C), written;
    both of the type of `before`
    """
    rows, columns = origins.shape
    across, down, constant, by_disparity = scale
    flat, rounding = before.reshape(-1), 0.5 if genes.itemsize == 2 else 0.0    # of whole ones
    for row in range(rows):
        for column in range(columns):
            origin = np.int64(origins[row, column])
            if origin < 0:
                genes[row, column] = fresh[row, column]
                continue
            gene = flat[origin]
            disparity = np.float64(gene) + lowest
            distance = (across * (origin % columns) + down * (origin // columns) + constant
                        + by_disparity * disparity)
            moved = disparity / max(distance, BEHIND) - lowest
            genes[row, column] = min(max(moved + rounding, 0.0), highest)
