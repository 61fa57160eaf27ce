# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Segments of like pixels; regions of weak texture, a plane for each, and the mutant of these planes.

Segments are those of Felzenszwalb and Huttenlocher, Efficient graph-based image segmentation,
2004. Regions of weak texture are grown by runs of a row, whose mean is less noisy than a pixel: no
edges are sorted, and noise joins no regions across an edge. Their coordinates are those of the
half-size image; its pixel (y, x) stands for the full pixels (2 y .. 2 y + 1, 2 x .. 2 x + 1).
"""
from fuzzy_stereo_ros.matching.kernels.addresses import next_byte
from fuzzy_stereo_ros.matching.kernels.compiled import inlined, kernel
from fuzzy_stereo_ros.matching.kernels.planes.fits import (
    agreeing, AGREEMENT, best_of_random, LEAST_POINTS, least_squares)
from fuzzy_stereo_ros.matching.kernels.possibility.features import MARGIN
from fuzzy_stereo_ros.matching.kernels.union_find import join, root
from fuzzy_stereo_ros.matching.kernels.units import CONSISTENT, STEPS
import numpy as np

STEP_PARTS = 16      # differences of pixels are counted in units of 1 / STEP_PARTS
LEVELS = 2**13       # larger differences count as equal


@kernel
def sort_edges(values, differences, starts, order):
    """
    Write the pairs of neighbours by ascending difference of their values.

    values: float32 (R, C, 3); differences: int16 (2 * R * C,), memory: of pixel p with its left
    neighbour at 2 p, with the upper one at 2 p + 1, -1 for none; starts: int32 (LEVELS + 1,),
    memory; order: int32 (2 * R * C,); returns how many pairs there are.
    """
    rows, columns = values.shape[:2]
    starts[:] = 0
    for row in range(rows):
        for column in range(columns):
            for side in range(2):
                y, x = row - side, column - 1 + side
                edge = 2 * (row * columns + column) + side
                differences[edge] = -1
                if y >= 0 and x >= 0:
                    total = np.float32(0)
                    for channel in range(3):
                        apart = values[row, column, channel] - values[y, x, channel]
                        total += apart * apart
                    level = np.int64(np.sqrt(total) * STEP_PARTS + np.float32(0.5))
                    level = min(level, LEVELS - 1)
                    differences[edge] = level
                    starts[level + 1] += 1
    for level in range(LEVELS):
        starts[level + 1] += starts[level]
    number = starts[LEVELS]
    for edge in range(2 * rows * columns):
        level = differences[edge]
        if level >= 0:
            order[starts[level]] = edge
            starts[level] += 1
    return number


@kernel
def join_pixels(order, differences, scale, smallest, parent, size, inner, labels):
    """
    Join pixels to segments; return how many there are.

    order, differences: of sort_edges; scale: px times grey levels, larger ones make larger
    segments; smallest: px; parent, size: int32 (R * C,), inner: float32 (R * C,), memory; labels:
    int32 (R, C), from 0, in the order of the segments' first pixels
    """
    columns, flat = labels.shape[1], labels.reshape(-1)
    for pixel in range(labels.size):
        parent[pixel], size[pixel], inner[pixel] = pixel, 1, 0
    for few in range(2):
        for edge in order:
            pixel = edge // 2
            one, other = root(parent, pixel), root(parent, pixel - (columns if edge % 2 else 1))
            if one == other:
                continue
            if few:
                joins = min(size[one], size[other]) < smallest
            else:
                apart = np.float32(differences[edge]) / np.float32(STEP_PARTS)
                joins = apart <= min(inner[one] + scale / size[one],
                                     inner[other] + scale / size[other])
                if joins:
                    inner[one] = apart
            if joins:
                parent[other] = one
                size[one] += size[other]
    number = 0
    for pixel in range(labels.size):
        above = root(parent, pixel)
        if size[above] > 0:                  # from here on size is minus the label, minus one
            size[above] = -1 - number
            number += 1
        flat[pixel] = -1 - size[above]
    return number


# `regions` are runs of like pixels in the rows of an image of r * c pixels, int32 (4, r * c): the
# first column of each, the one after its last, its parent in a union-find and its region, -1 for
# none; and int32 (r, 2), the first run of each row and the one after its last.
_FOLLOWS = 2         # a run's grey follows its pixels by a quarter of their difference
_REFITS = 4          # by least squares, each to what agrees with the one before
PLANES_TRIED, ENOUGH = 24, 0.9      # random planes of a region; share that agrees and ends this
ON_PLANE = 0.6       # share of a region's points that must lie within 1 px of its plane


@kernel(allocates=True)
def find_runs(luminance, weak, likeness, regions, first, last):
    """
    Write runs of similar pixels of weak texture and merge vertically adjacent similar ones.

    Those of the rows first .. last are numbered from first * c on.

    luminance: uint16 (r + 2 MARGIN, ...); weak: uint8 (r, c or more); likeness: the largest
    difference of a pixel from its run, 1 / 256 grey level, of which those of the means of two runs
    are half where they overlap, and the least px of that
    """
    (step, overlap), (runs, rows) = likeness, regions
    begin, end, parent, columns = runs[0], runs[1], runs[2], runs.shape[1] // len(rows)
    known, sums = first * columns, np.zeros((2, columns + 1), np.int32)     # of grey in the runs
    for row in range(first, last):
        here, above = sums[row & 1], sums[1 - (row & 1)]
        line, allowed = luminance[row + MARGIN], weak[row, :columns]
        rows[row, 0] = known
        total, column = np.int32(0), next_byte(allowed, 0, 0, False)
        while column < columns:
            grey = np.int32(line[np.uint64(column + MARGIN)])
            mean, difference = grey, np.int32(0)
            begin[known], parent[known], here[column] = column, known, total
            while abs(difference) <= step:
                mean += difference >> _FOLLOWS
                total, column = total + grey, column + 1
                here[column] = total
                if column == columns or not allowed[column]:
                    break
                grey = np.int32(line[np.uint64(column + MARGIN)])
                difference = grey - mean
            end[known] = column
            known += 1
            column = next_byte(allowed, column, 0, False)
        rows[row, 1] = known
        if row > first:
            _join(runs, rows, row, step, overlap, here, above)


@kernel(allocates=True)
def join_runs(luminance, likeness, regions, edges):
    """Join the runs of bands of rows where they meet; edges: the first row of each band."""
    (step, overlap), (runs, rows) = likeness, regions
    sums = np.zeros((2, runs.shape[1] // len(rows) + 1), np.int32)
    for row in edges[1:]:
        for part in range(2):
            total, line = np.int32(0), luminance[row - part + MARGIN]
            for column in range(sums.shape[1]):
                sums[part, column] = total
                total += np.int32(line[np.uint64(column + MARGIN)])
        _join(runs, rows, row, step, overlap, sums[0], sums[1])


@inlined
def _join(runs, rows, row, step, overlap, here, above):
    """Join the runs of a row with the like ones above; here, above: sums of grey from the left."""
    begin, end, parent, apart = runs[0], runs[1], runs[2], step // 2
    other, stop = rows[row - 1]
    for run in range(rows[row, 0], rows[row, 1]):
        while other < stop and end[other] <= begin[run]:
            other += 1
        upper = other
        while upper < stop and begin[upper] < end[run]:
            low, high = max(begin[upper], begin[run]), min(end[upper], end[run])
            difference = here[high] - here[low] - above[high] + above[low]
            if high - low >= overlap and abs(difference) <= apart * (high - low):
                join(parent, run, upper)
            upper += 1


@kernel
def number_regions(regions, least):
    """Give numbers to the regions of at least so many pixels; return how many there are."""
    runs, rows = regions
    begin, end, parent, region = runs[0], runs[1], runs[2], runs[3]
    for first, last in rows:
        for run in range(first, last):      # first the size, known for the first run of each
            region[run] = 0
            region[root(parent, run)] += end[run] - begin[run]
    number = 0
    for first, last in rows:
        for run in range(first, last):
            above = root(parent, run)
            if above != run:
                region[run] = region[above]
            elif region[run] >= least:
                region[run] = number
                number += 1
            else:
                region[run] = -1
    return number


@kernel
def count_matches(regions, validity, counts, first, last):
    """Count the consistent matches of each region, int32 (regions,), in some half-size rows."""
    runs, rows = regions
    begin, end, region = runs[0], runs[1], runs[3]
    counts[:] = 0
    for row in range(first, last):
        for run in range(rows[row, 0], rows[row, 1]):
            if region[run] >= 0:
                for column in range(begin[run], end[run]):
                    counts[region[run]] += validity[2 * row + 1, 2 * column + 1] == CONSISTENT


@kernel
def place_points(most, counts, every, places, starts):
    """
    Choose at most `most` matches of each region as points, evenly spread: one of `every`.

    counts: int32 (bands, regions), of count_matches, which become those since the last point of
    the bands before; every: int32 (regions,); places: int32, as counts or larger, where the first
    point of each band goes; starts: int32 (regions + 1,), the first point of each region and the
    one behind all
    """
    starts[0] = 0
    for region in range(every.size):
        total = counts[:, region].sum()
        every[region] = max((total + most - 1) // most, 1)
        before = 0
        for band in range(len(counts)):
            found = counts[band, region]
            places[band, region] = starts[region] + before // every[region]
            counts[band, region] = before % every[region]
            before += found
        starts[region + 1] = starts[region] + total // every[region]


@kernel
def gather_points(regions, every, waited, places, matches, points, first, last):
    """
    Write one of `every` matches of each region as points, in some half-size rows.

    waited, places: int32 (regions,), the counts and places of the band, overwritten; matches:
    labels, offsets, validity of the full image; points: float32 (3, r * c), x, y and disparity in
    full px
    """
    (runs, rows), (labels, offsets, validity) = regions, matches
    begin, end, region = runs[0], runs[1], runs[3]
    for row in range(first, last):
        for run in range(rows[row, 0], rows[row, 1]):
            mine = region[run]
            if mine < 0:
                continue
            for column in range(begin[run], end[run]):
                if validity[2 * row + 1, 2 * column + 1] == CONSISTENT:
                    waited[mine] += 1
                    if waited[mine] == every[mine]:
                        points[0, places[mine]], points[1, places[mine]] = column, row
                        points[2, places[mine]] = (
                            np.float32(labels[2 * row + 1, 2 * column + 1])
                            + np.float32(offsets[2 * row + 1, 2 * column + 1]) / np.float32(STEPS))
                        places[mine] += 1
                        waited[mine] = 0


@kernel
def fit_planes(points, starts, key, planes):
    """
    Fit a plane to each region: the best of random ones, then least squares.

    points, starts: of gather_points and place_points; planes: float32 (regions, 3), of half-size x
    and y and full disparity, NaN for none
    """
    limit, none = np.float32(1.5) * AGREEMENT, np.float32(np.nan)
    for region in range(starts.size - 1):
        first, last = starts[region], starts[region + 1]
        planes[region] = np.nan
        if last - first < LEAST_POINTS:
            continue
        most, plane = best_of_random(
            points, first, last, 1, (PLANES_TRIED, ENOUGH, key),
            np.uint64(3 * region * PLANES_TRIED), (none, none, none))
        if most < LEAST_POINTS:
            continue
        for _ in range(_REFITS):
            _, a, b, c = least_squares(
                points, first, last, plane, limit,
                (points[0, first], points[1, first], points[2, first]))
            plane = np.float32(a), np.float32(b), np.float32(c)
        if agreeing(points, first, last, 1, plane, np.float32(1)) >= ON_PLANE * (last - first):
            planes[region, 0], planes[region, 1], planes[region, 2] = plane


@kernel
def write_mutant(regions, planes, disparities, target_range, mutant, first, last):
    """
    Give the cells of regions that have a plane its labels where they differ by more than one.

    Only matches inside of the target range are proposed; first, last: half-size rows
    """
    (runs, rows), half = regions, np.float32(0.5)
    begin, end, region = runs[0], runs[1], runs[3]
    for row in range(first, last):
        for run in range(rows[row, 0], rows[row, 1]):
            mine = region[run]
            if mine < 0 or np.isnan(planes[mine, 0]):
                continue
            slope, fall, offset = planes[mine]
            for lower in range(2):
                y = 2 * row + lower
                disparity = (fall * (np.float32(row) + half * np.float32(lower - 1)) + offset
                             + slope * (np.float32(begin[run]) - half) + half)
                for column in range(2 * begin[run], 2 * end[run]):
                    label = np.int64(np.floor(disparity))
                    disparity += half * slope
                    if (0 <= label < disparities
                            and target_range[0] <= column - label <= target_range[1]
                            and abs(label - np.int64(mutant[y, column])) > 1):
                        mutant[y, column] = label
