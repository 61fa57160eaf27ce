# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Drift: how well a misaligned calibration is detected.

On synthetic scenes and real pairs, as they are and with the right image moved by a known error.
"""
from functools import partial
from typing import NamedTuple

from bench.conditions import misaligned
from bench.draws import in_words, means_over_draws
from bench.request import report_of
from fuzzy_stereo_ros.evaluation.ground_truth import KITTI
from fuzzy_stereo_ros.evaluation.report import Table
from fuzzy_stereo_ros.matching.row_offsets import LIMIT, SURE_DEVIATIONS
from fuzzy_stereo_ros.synthetic.scenes import make_sequence
import numpy as np

SIZE, QUICK_SIZE = (480, 640, 64), (96, 160, 16)    # rows, columns, disparities
FRAMES = 12
ERRORS = ({}, {'tilt': 0.3}, {'tilt': -1.0}, {'roll': 0.2}, {'roll': -0.1}, {'zoom': 0.3},
          {'zoom': -0.4}, {'tilt': 0.6, 'roll': 0.1, 'zoom': -0.2})
TURN = 0.2              # degrees
NOISE = 2.0             # grey levels, of made scenes


class Made(NamedTuple):
    """Made frames of a size with one of ERRORS, and noise."""

    path: str
    size: tuple
    error: dict
    noise: float = NOISE


def run(request):
    """Return the `Report` of the detection of misaligned pairs."""
    size = QUICK_SIZE if request.quick else SIZE
    scenes, skipped = request.scenes()
    made, real = request.drawn(
        ([Made(in_words_of(error), size, error) for error in ERRORS], 'made',
         partial(made_row, request.ours)),
        (scenes, 'real', partial(real_row, request.ours)))
    return report_of('drift', 'Drift of the calibration', {
        'ours': request.ours.description,
        'warning': f'tilt, roll, zoom or yaw above {LIMIT:g} px by {SURE_DEVIATIONS:g} standard '
                   'deviations; roll and zoom at the edges of the image, yaw in the corners',
        'made': f'{FRAMES} frames of {size[1]}x{size[0]}, noise of {NOISE:g} grey levels, the '
                'right image moved',
        **in_words(request.draws),
    }, [
        Table.of('Made scenes', means_over_draws(made, ['error']),
                 'Worst error: of the three, roll and zoom taken at the edges; warnings: percent '
                 f'of the draws. {in_short(real)}'),
    ], skipped, made=made, pairs=real)


def in_words_of(error):
    """Return one of ERRORS in words."""
    return ', '.join(f'{what} {value:g}' for what, value in error.items()) or 'as calibrated'


def checked(ours, pairs, disparities):
    """Return the Misalignment of (left, right) images matched in order, None of too few points."""
    matcher = ours.matcher(disparities, fill=False)
    for left, right in pairs:
        found = matcher.match(left, right).misalignment
    return found


def made_row(ours, subject, draw):
    """Return a list of a dict of what is found of an error in frames that pan, of a draw."""
    name, size, error, _ = subject
    frames = make_sequence(*size[:2], size[2], FRAMES, seed=1 + draw, objects=6, pan=5.0,
                           noise=NOISE)
    found = checked(ours, ((one.left, misaligned(one.right, **error)) for one in frames), size[2])
    if found is None:
        return [{'error': name}]
    edges = np.array([1.0, np.deg2rad(size[1] / 2), size[0] / 200])
    made = edges * [error.get(what, 0.0) for what in ('tilt', 'roll', 'zoom')]
    return [{'error': name, 'tilt [px]': found.tilt, 'roll [degrees]': found.roll_degrees,
             'zoom [%]': found.zoom_percent,
             'worst error [px]': float(np.abs(found[:3] - made).max()),
             'warnings [%]': 100.0 * bool(found.faults)}]


def real_row(ours, scene, draw):
    """Return dicts of a pair as it is and, of Middlebury, turned: scene, turn, roll, warning."""
    pair, rows = scene.read(), []
    for turn in (0.0,) if scene.family == KITTI else (0.0, TURN):
        found = checked(ours, [(pair.left, misaligned(pair.right, roll=turn) if turn
                                else pair.right)], scene.disparities)
        if found is not None:
            rows.append({'scene': scene.path, 'turn': turn, 'roll': found.roll,
                         'warning': bool(found.faults)})
    return rows


def in_short(real):
    """Return a sentence on a DataFrame of `real_row`."""
    return 'Of real pairs warn ' + ', '.join(
        f'{some.warning.sum()} of {len(some)} '
        + (f'turned by {turn:g} degrees' if turn else 'as they are')
        for turn, some in real.groupby('turn')) + '.' if len(real) else ''
