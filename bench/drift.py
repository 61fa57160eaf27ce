# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Drift: how well a misaligned calibration is detected, and what the detection costs.

On synthetic scenes and real pairs, as they are and with the right image moved by a known error.
"""
from itertools import islice

from bench.conditions import misaligned
from bench.request import report_of
from fuzzy_stereo_ros.evaluation.ground_truth import KITTI
from fuzzy_stereo_ros.evaluation.report import Table
from fuzzy_stereo_ros.matching.row_offsets import LIMIT, SURE
from fuzzy_stereo_ros.synthetic.scenes import make_sequence
import numpy as np

SIZE, QUICK_SIZE = (480, 640, 64), (96, 160, 16)    # rows, columns, disparities
COST_SIZES = (240, 320, 32), SIZE, (720, 1280, 128)
FRAMES = 12
ERRORS = ({}, {'tilt': 0.3}, {'tilt': -1.0}, {'roll': 0.2}, {'roll': -0.1}, {'zoom': 0.3},
          {'zoom': -0.4}, {'tilt': 0.6, 'roll': 0.1, 'zoom': -0.2})
SWINGS = 0.4, 0.8       # px, standard deviation of the offset from frame to frame
TURN = 0.2              # degrees
DRIVES = 'KITTI drive', 'EuRoC'
COST_FRAMES, QUICK_COST_FRAMES = 300, 5


def run(request):
    """Return the `Report` of the detection of misaligned pairs."""
    size = QUICK_SIZE if request.quick else SIZE
    scenes, skipped = request.scenes()
    sequences, missing = request.sequences(scenes)
    subjects = [*scenes, *(one for one in sequences if one.group in DRIVES)]
    steps = {
        'made': lambda: [_made_row(request, size, error) for error in ERRORS],
        'swings': lambda: [_swing_row(request, size, swing) for swing in SWINGS],
        'real': lambda: [row for one in subjects for row in _real_rows(request, one)],
        'cost': lambda: [_cost_row(request, one) for one in (
            [size] if request.quick else COST_SIZES)]}
    made, swings, real, cost = request.each(list(steps), 'drift', lambda name: steps[name]())
    return report_of('drift', 'Drift of the calibration', {
        'ours': request.ours.description,
        'warning': f'tilt, roll, zoom or yaw above {LIMIT:g} px by {SURE:g} standard deviations; '
                   'roll and zoom at the edges of the image, yaw in the corners',
        'made': f'{FRAMES} frames of {size[1]}x{size[0]}, noise of 2 grey levels, the right '
                'image moved',
        'cost': f'mean of {QUICK_COST_FRAMES if request.quick else COST_FRAMES} warm frames of a '
                'pair whose rows differ by a pixel',
    }, [
        Table('Made scenes', ('', 'tilt [px]', 'roll [degrees]', 'zoom [%]', 'worst error [px]',
                              'doubt [px]', 'warning'), made,
              'Worst error: of the three, roll and zoom taken at the edges; doubt: the largest '
              'standard deviation of the three.'),
        Table('Exposures at different moments', ('', 'swing [px]', 'warning'), swings,
              'The right image moves up and down, as where both shake and one exposes later.'),
        Table('Pairs, as they are and turned', (
            '', 'tilt [px]', 'roll [px]', 'zoom [px]', 'yaw [px]', 'doubt [px]', 'warning'),
              real, f'As they are, and with the right image turned by {TURN:g} degrees; roll and '
              'zoom at the edges.'),
        Table('What it costs', ('', 'frame [ms]', 'of it rows [ms]', 'share [%]',
                                'first frame, rows [ms]'), cost, 'Rows: they are measured now '
              'and then, and the right image is read at those of the left one. The first frame '
              'searches for features.', digits=3),
    ], [*skipped, *(one for one in missing if one not in skipped)], threads=1)


def _checked(request, pairs, disparities):
    """Return the Misalignment of (left, right) images matched in order, None of too few points."""
    matcher = request.ours.matcher(disparities, fill=False)
    for left, right in pairs:
        found = matcher.match(left, right).misalignment
    return found


def _frames(size, frames=FRAMES):
    """Return frames of a synthetic scene that pans, so that corners change."""
    return make_sequence(*size[:2], size[2], frames, seed=1, objects=6, pan=5.0, noise=2.0)


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


def _swing_row(request, size, swing):
    shifts = 2**0.5 * swing * np.sin(np.arange(2 * FRAMES))
    found = _checked(request, ((one.left, misaligned(one.right, tilt=shift)) for one, shift in zip(
        _frames(size, len(shifts)), shifts)), size[2])
    if found is None:
        return f'{swing:g} px', None, None
    return f'made {np.std(shifts):.2f} px', found.swing, _warning(found)


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


def _cost_row(request, size):
    """Return a row: milliseconds per frame of matching, and of the rows that are undone."""
    frames = [(one.left, misaligned(one.right, tilt=1.0)) for one in _frames(size, 6)]
    matcher = request.ours.matcher(size[2], fill=False)
    for pair in frames:
        matcher.match(*pair)
    count = QUICK_COST_FRAMES if request.quick else COST_FRAMES
    times = [matcher.match(*frames[number % len(frames)]).times for number in range(count)]
    first = request.ours.matcher(size[2], fill=False).match(*frames[0]).times['rows']
    total, rows = (float(np.mean([one[name] for one in times])) for name in ('total', 'rows'))
    return f'{size[1]}x{size[0]}x{size[2]}', total, rows, 100 * rows / total, first
