# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Plain twins of what the profile realtime sees of a pair: features, costs, scanline passes, choice.

Nothing is mirrored, padded or packed here: column c of an array is column c of the image, and
label d of a pixel points at column c - d of the target, at its first column where that is outside.
A target wider than the image has its extra columns before column 0.
"""
from fractions import Fraction
import math

import numpy as np
from reference import windows

# ---- features ----


def luminance(image, shift, places, extra=0):
    """
    Return (B + 2 G + R, or the one channel) * 2**places, at most 65535, of the shifted image.

    extra: columns before column 0; int64 (R, extra + C).
    """
    columns = image.shape[1]
    source = np.clip(np.arange(extra + columns) - extra - shift, 0, columns - 1)
    channels = image.reshape(*image.shape[:2], -1)[:, source].astype(np.int64)
    grey = channels @ ((1, 2, 1) if image.ndim == 3 else (1,))
    return np.minimum(np.floor(grey * 2.0**places), 65535).astype(np.int64)


def eight_bits(luminance):
    """Return luminance / 256, rounded, at most 255."""
    return np.minimum(np.floor(luminance / 256 + 0.5), 255).astype(np.int64)


def smoothed(image, share=1):
    """Return an image moved by a share to its rounded binomial means of 3 x 3: int64 (R, C)."""
    means = (windows(image.astype(np.int64), 1) @ np.outer((1, 2, 1), (1, 2, 1)).ravel() + 8) // 16
    return np.clip(image + share * (means - image), 0, 2**16 - 1)


def steps(luminance):
    """
    Return sums of second differences along every eighth row, over 1 px and 2 px, in quarters.

    Columns count as far as there are 32 of them.
    """
    columns = luminance.shape[1] // 32 * 32
    around = np.pad(luminance[::8], ((0, 0), (2, 2)), 'edge') // 4
    return [abs(2 * around[:, 2:columns + 2] - around[:, 2 - far:columns + 2 - far]
                - around[:, 2 + far:columns + 2 + far]).sum() for far in (1, 2)]


def coefficient_counts(grey, apart):
    """
    Return how many coefficients of blocks of 8 x 8 pixels are small, large, and in the middle.

    grey: (R, C), grey levels. Of seven frequencies, of one block in so many of each row of blocks.
    """
    waves = np.cos(np.outer(np.arange(8), 2 * np.arange(8) + 1) * np.pi / 16) / 2
    found = [abs(waves[down] @ grey[8 * row:8 * row + 8, 8 * column:8 * column + 8] @ waves[right])
             for row in range(grey.shape[0] // 8)
             for column in range(3 * row % apart, grey.shape[1] // 8, apart)
             for down, right in ((1, 2), (2, 1), (2, 2), (1, 3), (3, 1), (2, 3), (3, 2))]
    return [sum(low <= size < high for size in found)
            for low, high in ((1.5, 3.5), (4.5, 24.5), (4.5, 8))]


def halved(values, rounded):
    """Return the mean of 2 x 2 pixels, rounded or cut; an odd last row or column is left out."""
    rows, columns = values.shape[0] // 2, values.shape[1] // 2
    mean = values[:2 * rows, :2 * columns].reshape(rows, 2, columns, 2).mean(axis=(1, 3))
    return np.floor(mean + 0.5 * rounded).astype(np.int64)


def census(luminance, least_step=0):
    """
    Return a code of 24 bits a pixel, set where a neighbour in 5 x 5 is darker by > least_step.

    The nearest eight neighbours have the lowest bits; both kinds come row by row.
    """
    near = [6, 7, 8, 11, 13, 16, 17, 18]
    places = near + [place for place in range(25) if place not in (12, *near)]
    darker = windows(luminance, 2)[..., places] < (luminance - least_step)[..., np.newaxis]
    return darker @ 2**np.arange(24)


def denoised(luminance, tolerance):
    """Return the mean of 3 x 3 pixels, rounded down, where a pixel differs from it by little."""
    total = windows(luminance.astype(np.int64), 1).sum(axis=2)
    return np.where(abs(9 * luminance - total) > 9 * tolerance, luminance, total // 9)


def gradient(grey):
    """Return half of the central difference along the row, 128 where it is 0 or unknown."""
    slopes = np.full(grey.shape, 128)
    slopes[:, 1:-1] += (grey[:, 2:].astype(int) - grey[:, :-2]) // 2
    return slopes


def jump_table(model, noise=0.0):
    """Return what a jump costs by the grey step: it falls up to 20 grey levels, more in noise."""
    fall = math.ceil(256 * (model.jump - model.jump_at_edge) / int(20 + 2 * noise))
    return np.array([max(model.jump - (min(step, 63) * fall // 256), model.jump_at_edge)
                     for step in range(256)])


def jump_penalties(grey, table):
    """Return what a jump to the left and to the upper neighbour costs, by the grey step."""
    grey = grey.astype(int)
    return (table[abs(np.diff(grey, axis=1, prepend=grey[:, :1]))],
            table[abs(np.diff(grey, axis=0, prepend=grey[:1]))])


# ---- costs ----


def match_costs(features, target, labels, model):
    """
    Return the costs of the labels 0 .. labels - 1 of every pixel: int64 (R, C, labels).

    features, target: (census codes, slopes) of an image; model: beyond its cuts a Hamming
    distance, a difference of slopes say no more; its near_weight is that of the lowest eight bits.
    """
    columns = np.arange(features[0].shape[1])
    extra = target[0].shape[1] - columns.size
    volume = []
    for label in range(labels):
        seen = np.maximum(extra + columns - label, 0)
        differing = features[0] ^ target[0][:, seen]
        distance = sum((differing >> bit & 1) * (model.near_weight if bit < 8 else 1)
                       for bit in range(24))
        step = abs(features[1] - target[1][:, seen])
        volume.append(np.minimum(distance, model.census_cut) + np.minimum(step, model.slope_cut))
    return np.stack(volume, axis=2)


def prior_costs(prior_labels, weights, labels):
    """Return what a prior map adds to the costs: int64 (R, C, labels)."""
    # weights: 16 times the dead zone, and the cut. Labels are compared modulo 256.
    dead_zones, cuts = np.divmod(weights.astype(int)[..., np.newaxis], 16)
    away = (np.arange(labels) - prior_labels[..., np.newaxis].astype(int)) % 256
    return np.clip(np.minimum(away, 256 - away) - dead_zones, 0, cuts)


def box_costs(volume, labels, places, side):
    """
    Return the sums over 3 x 3 pixels / 2**places, cut: int64 (R, C, labels).

    Apart for each tile, borders repeated; it has `side` columns up to its last one. Columns before
    the image are those of the target, compared with column 0. volume: (R, C, labels + side)
    """
    sums = np.zeros((*volume.shape[:2], labels), np.int64)
    for top in range(0, len(volume), side):
        for left in range(0, volume.shape[1], side):
            rows, end = volume[top:top + side], min(left + side, volume.shape[1])
            tile = np.stack([rows[:, max(column, 0), max(-column, 0):][:, :labels]
                             for column in range(end - side, end)], axis=1)
            around = np.pad(tile, ((1, 1), (1, 1), (0, 0)), 'edge')
            box = sum(around[down:down + len(rows), right:right + side]
                      for down, right in np.ndindex(3, 3)) // 2**places
            sums[top:top + side, left:end] = box[:, side - (end - left):]
    return sums


# ---- scanline passes ----


def pass_along(costs, jumps, small, closed):
    """
    Return L(p, d) of paths along the second axis: int64 (lines, pixels, D), at most 255.

    jumps: (lines, pixels), P2 between a pixel and the one before it; closed: bool (lines, pixels,
    D), labels of a pixel that none of the pixels beside it looks at, and that look at no other.
    """
    paths = np.minimum(costs, 255)
    for place in range(1, costs.shape[1]):
        # how much dearer than the least each path is
        before = paths[:, place - 1] - paths[:, place - 1].min(axis=1, keepdims=True)
        before[closed[:, place - 1] | closed[:, place]] = 255
        beside = np.pad(before, ((0, 0), (1, 1)), constant_values=255)
        cheapest = np.minimum.reduce([
            before, np.broadcast_to(jumps[:, place, None], before.shape),
            beside[:, :-2] + small, beside[:, 2:] + small])
        paths[:, place] = np.minimum(costs[:, place] + cheapest, 255)
    return paths


def summed_passes(costs, closed, across, down, small):
    """Return the sum of the passes right, left, down and up: int64 (R, C, D), at most 255."""
    # closed: bool (R, C, D), labels that a pixel does not have
    costs, total = np.where(closed, 255, costs), 0
    for axes, jumps in (((0, 1, 2), across), ((1, 0, 2), down)):
        costs_along, closed_along = costs.transpose(axes), closed.transpose(axes)
        jumps = jumps.transpose(axes[:2])
        for step, between in ((1, jumps), (-1, np.roll(jumps, -1, axis=1))):
            paths = pass_along(costs_along[:, ::step], between[:, ::step], small,
                               closed_along[:, ::step])
            total = total + paths[:, ::step].transpose(axes)
    return np.minimum(total, 255)


# ---- choice ----


def equiangular(below, here, above):
    """Return where two lines of equal slope through three costs meet, in 1/16 px, rounded."""
    rise = max(below, above) - here
    if rise <= 0:
        return 0
    offset = Fraction(8 * (below - above), rise)
    return int(math.copysign(math.floor(abs(offset) + Fraction(1, 2)), offset))


def winner(sums, labels):
    """Return the first best of labels by their sums, its offset, its sum, and its margin."""
    # The margin is by how much the best label elsewhere is dearer; offsets need both neighbours.
    place = int(np.argmin(sums))
    label, least, known = labels[place], int(sums[place]), dict(zip(labels, map(int, sums)))
    elsewhere = min((total for other, total in known.items() if abs(other - label) > 1),
                    default=255)
    offset = 0
    if {label - 1, label + 1} <= set(labels):
        offset = equiangular(known[label - 1], least, known[label + 1])
    return label, offset, least, elsewhere - least


def chosen_by_target(labels, sums, extra=0, hides=8):
    """
    Return the target's labels modulo 256, 0 where no pixel points: int64 (R, extra + C).

    labels, sums: (R, C), what each pixel chose; extra: target columns before column 0. Of the
    pixels that point at the same place, from the farthest to the nearest, each takes the place of
    the one before unless it costs more than `hides` more.
    """
    target = np.zeros((len(labels), extra + labels.shape[1]), np.int64)
    for row in range(len(labels)):
        known = {}
        for column, (label, cost) in enumerate(zip(labels[row].tolist(), sums[row].tolist())):
            pointed = extra + column - label
            if pointed >= 0 and cost <= known.get(pointed, 999) + hides:
                known[pointed], target[row, pointed] = cost, label % 256
    return target
