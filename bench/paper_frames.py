# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The paper's algorithm over frames: each frame begins with the population of the one before.

Courses of frames begin with random maps. Beside them stands their last frame matched cold by the
profile `paper`.
"""
from functools import partial

from bench.datasets import window
from bench.draws import means_over_draws
from bench.request import counted, Subject
from bench.scoring import bad_percent, ScoredSequence
from fuzzy_stereo_ros.evaluation.matchers import Ours
from fuzzy_stereo_ros.evaluation.report import Table

NOISE, PAN = 1.5, 2                 # grey levels; px a frame
STILL_FRAMES, PAN_FRAMES = 24, 16
QUICK_FRAMES = 2
SHOWN = 1, 2, 4, 8
LIVE = 'paper_live'
STILL, PANS = f'still, noise {NOISE}', f'pan of {PAN} px, noise {NOISE}'
DRIVES = 'KITTI drive', 'made, drive'


def courses(pairs, sequences, quick=False):
    """Return the `ScoredSequence`s over some scenes, and the drives among some sequences."""
    def frames(number):
        return QUICK_FRAMES if quick else number

    found = [ScoredSequence(kind, scene.name, scene.family, scene.disparities, partial(
        window, scene, pan, frames(number)), noise=NOISE)
             for kind, pan, number in ((STILL, 0, STILL_FRAMES), (PANS, PAN, PAN_FRAMES))
             for scene in pairs]
    return [*found, *(one for one in sequences if one.group in DRIVES)]


def measure(subject, draw):
    """
    Return a list of a dict of a course, of a draw of noise and of random maps.

    frame N: error in percent; last: of the last frame; cold: of that frame alone
    """
    course = subject.scene
    live, cold = (Ours(profile, profile, {'seed': draw}).matcher(
        course.disparities, warm_start=warm) for profile, warm in ((LIVE, True), ('paper', False)))
    found = {'kind': course.group, 'scene': course.name}
    for number, known in enumerate(course.drawn(draw), 1):
        match = live.match(known.left, known.right, camera=course.camera)
        if known.truth is not None:
            found['last'] = found[f'frame {number}'] = bad_percent(
                match.disparity, known, course.limit)
    found['cold'] = bad_percent(cold.match(known.left, known.right).disparity, known, course.limit)
    return [found]


def over_frames(request, pairs):
    """Return a DataFrame of the figures of `measure`; pairs: scenes."""
    found = courses(pairs, request.sequences(pairs)[0], request.quick)
    # Also without noise, draws differ: in the random maps.
    figures, = request.drawn(([Subject(one, LIVE, True) for one in found], 'over frames', measure))
    return figures


def frames_table(found):
    """Return the table of errors over frames of a DataFrame of figures of `measure`."""
    table = means_over_draws(counted(found, 'kind'), ['kind'])
    shown = [f'frame {number}' for number in SHOWN]
    return Table.of('Over frames: error in percent',
                    table[[name for name in (*shown, 'last', 'cold') if name in table]],
                    f'Profile {LIVE}, begun with random maps, of each draw others. Cold: the last '
                    'frame alone by the profile paper.')
