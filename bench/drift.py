# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Drift: how well a misaligned calibration is detected.

On synthetic scenes and real pairs, as they are and with the right image moved by a known error.
"""
from itertools import islice

from bench.conditions import misaligned
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
DRIVES = 'KITTI drive', 'EuRoC'


def run(request):
    """Return the `Report` of the detection of misaligned pairs."""
    size = QUICK_SIZE if request.quick else SIZE
    scenes, skipped = request.scenes()
    sequences, missing = request.sequences(scenes)
    subjects = [*scenes, *(one for one in sequences if one.group in DRIVES)]
    made = request.each(ERRORS, 'made', lambda error: _made_row(request, size, error))
    real = request.each(subjects, 'real', lambda one: _real_rows(request, one))
    return report_of('drift', 'Drift of the calibration', {
        'ours': request.ours.description,
        'warning': f'tilt, roll, zoom or yaw above {LIMIT:g} px by {SURE_DEVIATIONS:g} standard '
                   'deviations; roll and zoom at the edges of the image, yaw in the corners',
        'made': f'{FRAMES} frames of {size[1]}x{size[0]}, noise of 2 grey levels, the right '
                'image moved',
    }, [
        Table('Made scenes', ('', 'tilt [px]', 'roll [degrees]', 'zoom [%]', 'worst error [px]',
                              'doubt [px]', 'warning'), made,
              'Worst error: of the three, roll and zoom taken at the edges; doubt: the largest '
              'standard deviation of the three.'),
        Table('Pairs, as they are and turned', (
            '', 'tilt [px]', 'roll [px]', 'zoom [px]', 'yaw [px]', 'doubt [px]', 'warning'),
              [row for rows in real for row in rows], 'As they are, and with the right image '
              f'turned by {TURN:g} degrees; roll and zoom at the edges.'),
    ], [*skipped, *(one for one in missing if one not in skipped)], threads=1)


def _checked(request, pairs, disparities):
    """Return the Misalignment of (left, right) images matched in order, None of too few points."""
    matcher = request.ours.matcher(disparities, fill=False)
    for left, right in pairs:
        found = matcher.match(left, right).misalignment
    return found


def _frames(size):
    """Return frames of a synthetic scene that pans, so that corners change."""
    return make_sequence(*size[:2], size[2], FRAMES, seed=1, objects=6, pan=5.0, noise=2.0)


def _warning(found):
    return ', '.join(found.faults) or 'none'


def _made_row(request, size, error):
    found = _checked(request, ((one.left, misaligned(one.right, **error))
                               for one in _frames(size)), size[2])
    name = ', '.join(f'{what} {value:g}' for what, value in error.items()) or 'as calibrated'
    if found is None:
        return name, *[None] * 6
    edges = np.array([1.0, np.deg2rad(size[1] / 2), size[0] / 200])
    made = edges * [error.get(what, 0.0) for what in ('tilt', 'roll', 'zoom')]
    return (name, found.tilt, found.roll_degrees, found.zoom_percent,
            float(np.abs(found[:3] - made).max()), max(found.doubts), _warning(found))


def _real_rows(request, subject):
    """Return the row of a scene or sequence, and for a Middlebury scene one of it turned."""
    read = subject.read()
    pairs = [read] if hasattr(read, 'left') else list(islice(read, FRAMES))
    turns = (0.0,) if subject.family == KITTI or len(pairs) > 1 else (0.0, TURN)
    rows = []
    for turn in turns:
        found = _checked(request, ((one.left, misaligned(one.right, roll=turn) if turn
                                    else one.right) for one in pairs), subject.disparities)
        name = subject.path + f', turned by {turn:g} degrees' * bool(turn)
        rows.append((name, *[None] * 6) if found is None else
                    (name, *found[:4], max(found.doubts), _warning(found)))
    return rows
