# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Sequences for the warm start: real pairs that move and are noisy, drives, cuts, made ones."""
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise

from fuzzy_stereo_ros.benchmarks.speed import with_noise
from fuzzy_stereo_ros.evaluation.ground_truth import KITTI, KnownPair, LIMITS, MIDDLEBURY
from fuzzy_stereo_ros.pairs.disparity_files import read_disparity
from fuzzy_stereo_ros.pairs.image_files import read_pair
from fuzzy_stereo_ros.synthetic.scenes import made_sequence
import numpy as np

NOISES = (0, 3, 6, 12)
PANS = (0, 2, 8)
WINDOW_FRAMES, FIRST_SCORED = 6, 2
KITTI_DRIVE = 'kitti2012_seq/000027'
KITTI_FRAMES, KITTI_DISPARITIES = (7, 8, 9, 10), 96
EUROC, EUROC_FRAMES, EUROC_DISPARITIES = 'euroc_v101_rect', 10, 64
MADE = {'rows': 240, 'columns': 320, 'disparities': 48, 'colour': True}
APPEARS = 3


@dataclass(frozen=True)
class Sequence:
    """
    Frames of one kind; `read()` returns them as a list of `KnownPair`.

    kind: sequences of one kind share a line of the table. scored: numbers of the frames whose
    error counts, those without truth left out. pan: pixels per frame that the window moves to
    the right. flickers: whether changes between frames tell anything.
    """

    kind: str
    name: str
    family: str
    disparities: int
    read: Callable
    scored: range
    pan: int = 0
    flickers: bool = True

    @property
    def path(self):
        """Kind and name, as they are shown."""
        return f'{self.kind}, {self.name}'

    @property
    def limit(self):
        """Errors above so many pixels are bad."""
        return LIMITS[self.family]


def available_sequences(data, scenes):
    """
    Return the sequences that can be made here, and a sentence for each that cannot.

    data: Path or None. scenes: of the datasets; windows move over the four classic pairs, else
    over what there is.
    """
    found, skipped = [], []
    drive = data / KITTI_DRIVE if data is not None else None
    if drive is not None and drive.is_dir():
        found.append(Sequence('KITTI drive', KITTI_DRIVE.split('/')[1], KITTI, KITTI_DISPARITIES,
                              partial(_read_drive, drive), range(len(KITTI_FRAMES))))
    else:
        skipped.append(f'no folder: {KITTI_DRIVE}')
    still = [scene for scene in scenes if scene.family == MIDDLEBURY]
    classic = [scene for scene in still if scene.group == 'middv2']
    for noise in NOISES:
        for pan in PANS:
            found += [Sequence(f'window, noise {noise}, pan {pan}', scene.name, MIDDLEBURY,
                               scene.disparities, partial(window, scene, noise, pan),
                               range(FIRST_SCORED, WINDOW_FRAMES), pan)
                      for scene in classic or still]
    real = [scene for scene in still if scene.group in ('middv2', 'midd2006_third')] or still
    found += [Sequence('hard cut', f'{before.name} to {after.name}', MIDDLEBURY,
                       max(before.disparities, after.disparities),
                       partial(hard_cut, before, after), range(2, 3), flickers=False)
              for before, after in pairwise(real)]
    made = {'made, moving': {'motion': 3.0}, 'made, moving, noise 6': {'motion': 3.0, 'noise': 6},
            'made, exposure swings': {'motion': 1.0, 'noise': 3, 'flicker': 0.3}}
    for kind, options in made.items():
        found += [Sequence(kind, f'seed {seed}', MIDDLEBURY, MADE['disparities'],
                           partial(moving, seed, options), range(FIRST_SCORED, 8))
                  for seed in (1, 2, 3)]
    found += [Sequence('made, object appears', f'seed {seed}', MIDDLEBURY, MADE['disparities'],
                       partial(appearing, seed), range(APPEARS, APPEARS + 2))
              for seed in (1, 2, 3)]
    indoors = data / EUROC if data is not None else None
    if indoors is not None and indoors.is_dir():
        found.append(Sequence('EuRoC', 'V1_01, flicker only', MIDDLEBURY, EUROC_DISPARITIES,
                              partial(_read_euroc, indoors), range(0)))
    else:
        skipped.append(f'no folder: {EUROC}')
    return found, skipped


def window(scene, noise, pan, frames=WINDOW_FRAMES):
    """
    Return frames of a scene seen through a window that moves to the right, with fresh noise.

    noise: grey levels, standard deviation. pan: pixels per frame.
    """
    known = scene.read()
    chance = np.random.default_rng(5)
    width = known.truth.shape[1] - pan * (frames - 1)
    if width < 2:
        raise ValueError(f'{frames} frames at {pan} pixels leave nothing of {scene.path}')
    shown = []
    for frame in range(frames):
        part = cropped(known, known.truth.shape[0], width, pan * frame)
        shown.append(replace(part, left=with_noise(part.left, noise, chance),
                             right=with_noise(part.right, noise, chance)))
    return shown


def cropped(known, rows, columns, first_column=0):
    """Return rows and columns of a `KnownPair`; what leaves the right image does not count."""
    part = slice(0, rows), slice(first_column, first_column + columns)
    inside = np.arange(columns) - known.truth[part] >= 0
    counts = inside if known.counts is None else inside & known.counts[part]
    return KnownPair(np.ascontiguousarray(known.left[part]),
                     np.ascontiguousarray(known.right[part]), known.truth[part], counts,
                     known.whole_pixel)


def hard_cut(before, after):
    """Return two frames of one scene, then one of another, all of the size that fits both."""
    first, second = before.read(), after.read()
    rows, columns = np.minimum(first.truth.shape, second.truth.shape)
    first, second = (cropped(known, rows, columns) for known in (first, second))
    return [first, first, second]


def moving(seed, options):
    """Return eight frames of a made scene whose objects move."""
    return [_known(made) for made in made_sequence(frames=8, seed=seed, objects=5, **MADE,
                                                   **options)]


def appearing(seed):
    """Return frames of a made scene in which an object is there from one frame to the next."""
    # The objects of a seed are drawn one after the other: five are four and one more.
    fewer, more = (list(made_sequence(frames=APPEARS + 2, seed=seed, objects=count, motion=1.0,
                                      noise=2, **MADE)) for count in (4, 5))
    return [_known(made) for made in (*fewer[:APPEARS], *more[APPEARS:])]


def _known(made):
    return KnownPair(made.left, made.right, made.truth, made.visible)


def _read_drive(folder):
    """Return the frames up to the one with a truth, which holds visible pixels only."""
    truth = read_disparity(folder / 'disp_noc_10.png')
    return [KnownPair(*read_pair(folder / f'left_{number:02}.png',
                                 folder / f'right_{number:02}.png'),
                      truth if number == 10 else None)
            for number in KITTI_FRAMES]


def _read_euroc(folder):
    return [KnownPair(*read_pair(folder / 'left' / f'{number:04}.png',
                                 folder / 'right' / f'{number:04}.png'), None)
            for number in range(EUROC_FRAMES)]
