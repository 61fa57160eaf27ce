# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The scenes and sequences of the benchmarks: of the data folder, and synthetic ones.

Sequences are windows that move over real pairs; drives; hard cuts; synthetic ones. The truth
belongs to the left image; the matching pixel of the right image is x - d.
"""
from dataclasses import replace
from functools import partial
from importlib.util import find_spec
from itertools import pairwise
import os
from pathlib import Path

from bench.layers import make_layers
from bench.scoring import ScoredPair, ScoredSequence
from bench.streets import make_pictured_street
from fuzzy_stereo_ros.evaluation.catalogue import (
    files_of, FRAMES, FRAMES_IN_FOLDERS, ONE_PAIR, Scene)
from fuzzy_stereo_ros.evaluation.ground_truth import KITTI, MIDDLEBURY, seen_by_both
from fuzzy_stereo_ros.matching.match import Camera
from fuzzy_stereo_ros.synthetic.scenes import FOCAL, make_pair, make_sequence
import numpy as np

DATA_VARIABLE = 'FUZZY_STEREO_DATA'
USUAL_DATA = Path('../shared/data')
# group: {scene: (grey levels per pixel of disparity, disparities)}
MIDDLEBURY_FOLDERS = {
    'middv2': {'tsukuba': (16, 16), 'venus': (8, 20), 'teddy': (4, 60), 'cones': (4, 60)},
    'midd2001': {'bull': (8, 21), 'sawtooth': (8, 19)},
    'midd2006_third': {
        'Aloe': (3, 72), 'Baby1': (3, 47), 'Bowling1': (3, 78), 'Cloth1': (3, 59),
        'Cloth3': (3, 57), 'Flowerpots': (3, 62), 'Lampshade1': (3, 66), 'Midd1': (3, 70),
        'Rocks1': (3, 58), 'Wood1': (3, 73)},
    'midd2006_half': {'Cloth3': (2, 84)},
}
WHOLE_PIXELS = 'middv2/tsukuba'     # whose truth has no others
# {folder: (number of the frame, disparities)}
KITTI_FOLDERS = {'kitti2015/000000': ('', 66), 'kitti2012_color/000000': ('', 71),
                 'kitti2012_seq/000027': ('10', 96), 'kitti2012_seq/000138': ('10', 73)}
MOTORCYCLE, MOTORCYCLE_DISPARITIES = 'midd2014/Motorcycle', 64
MADE_SCENES, MADE_SIZE = 4, (240, 320, 48)      # rows, columns, disparities
QUICK_SCENES, QUICK_SIZE = 2, (48, 80, 16)
QUICK_KINDS = 'window, noise 0, pan 0', 'window, noise 6, pan 8', 'hard cut'

NOISES = (0, 3, 6, 12)
PANS = (0, 8)
WINDOW_FRAMES, FIRST_SCORED = 6, 2
KITTI_DRIVE, OTHER_DRIVE = 'kitti2012_seq/000027', 'kitti2012_seq/000138'
KITTI_NOISE = 3         # grey levels, in half of the drives
# group, folder and frames, also backwards; the last one has a truth
KITTI_DRIVES = (('KITTI drive', KITTI_DRIVE, ('07', '08', '09', '10')),
                ('KITTI drive, backwards', KITTI_DRIVE, ('11', '10')),
                ('KITTI drive, backwards', OTHER_DRIVE, ('11', '10')))
KITTI_DISPARITIES = 96
CALIBRATION = 'calib.txt'
EUROC, EUROC_DISPARITIES, EUROC_NOISES = 'euroc_v101_rect', 64, (0, 6)
EUROC_FRAMES = tuple(f'{number:04}' for number in range(10))
MADE = {'rows': 240, 'columns': 320, 'disparities': 48, 'colour': True}
MADE_CAMERA = Camera(FOCAL * MADE['columns'], FOCAL * MADE['columns'],
                     (MADE['columns'] - 1) / 2, (MADE['rows'] - 1) / 2)
DRIVE = {'drive': 0.08, 'pan': 2.0}     # m and px a frame
MADE_KINDS = {'made, moving': {'motion': 3.0},
              'made, moving, noise 6': {'motion': 3.0, 'noise': 6},
              'made, drive': DRIVE, 'made, drive, noise 6': {**DRIVE, 'noise': 6},
              'made, drive, objects move': {**DRIVE, 'noise': 2, 'motion': 3.0}}
MADE_SEEDS = 1, 2, 3
PICTURED_NOISES = 0, 3
SHARP, SHARP_PAN = {'contrast': 30, 'blur': 0.3}, 2      # texture as sharp as a pixel
APPEARS = 3


def data_folder(given=None):
    """
    Return the folder of benchmark data, or None if there is none.

    given: a path; None = $FUZZY_STEREO_DATA, else ../shared/data if that exists. Raises ValueError
    if a named folder does not exist.
    """
    named = given if given is not None else os.environ.get(DATA_VARIABLE)
    if named is None:
        return USUAL_DATA if USUAL_DATA.is_dir() else None
    if not Path(named).is_dir():
        raise ValueError(f'there is no folder {named}; give the folder that holds '
                         f'{", ".join(MIDDLEBURY_FOLDERS)} and the like')
    return Path(named)


def available_scenes(data, only='', quick=False):
    """
    Return the available scenes, and sentences about the missing ones.

    data: Path or None. only: a word that group/name must contain. quick: only small synthetic
    scenes. Raises ValueError if no scene is left.
    """
    scenes, missing = [], {}
    for scene, reason in _made_scenes(QUICK_SCENES, QUICK_SIZE) if quick else (
            *_folder_scenes(data), *_made_scenes(MADE_SCENES, MADE_SIZE)):
        if only in scene.path and reason is None:
            scenes.append(scene)
        elif only in scene.path:
            missing.setdefault(f'{reason}: {scene.group}', []).append(scene.name)
    skipped = [f'{start} ({", ".join(names)})' for start, names in missing.items()]
    if not scenes:
        raise ValueError(f"--only is '{only}', which no scene has in its name; groups are "
                         f'{", ".join(MIDDLEBURY_FOLDERS)}, kitti, midd2014 and made'
                         + (f' ({"; ".join(skipped)})' if skipped else ''))
    return scenes, skipped


def _folder_scenes(data):
    """Yield each `Scene` of the data folder, and why it is missing or None."""
    listed = [(group, name, MIDDLEBURY, disparities, f'{group}/{name}', '', levels)
              for group, named in MIDDLEBURY_FOLDERS.items()
              for name, (levels, disparities) in named.items()]
    listed += [('kitti', folder, KITTI, disparities, folder, number, None)
               for folder, (number, disparities) in KITTI_FOLDERS.items()]
    listed.append((*MOTORCYCLE.split('/'), MIDDLEBURY, MOTORCYCLE_DISPARITIES, MOTORCYCLE, '',
                   None))
    for *named, folder, number, levels in listed:
        if data is not None and (data / folder).is_dir():
            files, _ = files_of(data / folder, FRAMES if number else ONE_PAIR, number, levels)
            yield Scene(*named, partial(_read, files, folder == WHOLE_PIXELS),
                        files={number: files}), None
        elif folder == MOTORCYCLE:
            yield Scene(*named, read_motorcycle), (
                None if find_spec('skimage') else 'neither folder nor scikit-image')
        else:
            yield Scene(*named, None), 'no folder'


def read_motorcycle():
    """Return the Motorcycle pair of scikit-image (Middlebury 2014, a quarter of its size)."""
    from skimage.data import stereo_motorcycle  # takes a second

    left, right, truth = stereo_motorcycle()
    truth = np.where(np.isfinite(truth), truth, np.nan).astype(np.float32)
    return ScoredPair(*(np.ascontiguousarray(image[:, :, ::-1]) for image in (left, right)),
                      truth, seen_by_both(truth))


def _read(files, whole_pixel):
    """Return the `ScoredPair` of files; for KITTI all pixels with a truth count."""
    pair = ScoredPair(**vars(files.read()), whole_pixel=whole_pixel)
    return replace(pair, counts=None) if files.family == KITTI else pair


def _made_scenes(count, size):
    """Return [(synthetic `Scene`, None)] of a size (rows, columns, disparities)."""
    return [(Scene('made', f'planes{seed}', MIDDLEBURY, size[2], partial(_made, size, seed)), None)
            for seed in range(1, count + 1)]


def _made(size, seed):
    return ScoredPair(*make_pair(*size, seed, objects=6, noise=1.5, colour=True))


def available_sequences(data, scenes, quick=False):
    """
    Return the available sequences, and sentences about the missing ones.

    data: Path or None. scenes: of the benchmarks; windows move over the four classic pairs if they
    are among them, else over all. quick: few sequences that need no data.
    """
    single = [scene for scene in scenes if scene.family == MIDDLEBURY]
    classic = [scene for scene in single if scene.group == 'middv2'] or single
    real = [scene for scene in single if scene.group in ('middv2', 'midd2006_third')] or single
    synthetic = partial(ScoredSequence, family=MIDDLEBURY, disparities=MADE['disparities'],
                        alike=False)
    found = [
        *(ScoredSequence(f'window, noise {noise}, pan {pan}', scene.name, MIDDLEBURY,
                         scene.disparities, partial(window, scene, pan), noise=noise, pan=pan,
                         scored=range(FIRST_SCORED, WINDOW_FRAMES))
          for noise in NOISES for pan in PANS for scene in classic),
        *(ScoredSequence('hard cut', f'{before.name} to {after.name}', MIDDLEBURY,
                         max(before.disparities, after.disparities),
                         partial(hard_cut, before, after), scored=range(2, 3), flickers=False)
          for before, after in pairwise(real)),
        *(synthetic(kind, f'seed {seed}', read=partial(moving, seed, options),
                    noise=options.get('noise', 0), scored=range(FIRST_SCORED, 8),
                    camera=MADE_CAMERA if 'drive' in options else None)
          for kind, options in MADE_KINDS.items() for seed in MADE_SEEDS),
        *(synthetic(f'made, pictured street, noise {noise}', f'seed {seed}', camera=MADE_CAMERA,
                    read=partial(pictured, seed), noise=noise, scored=range(FIRST_SCORED, 8))
          for noise in PICTURED_NOISES for seed in MADE_SEEDS if find_spec('skimage')),
        *(synthetic(f'made, sharp texture, pan {SHARP_PAN}', f'seed {seed}', pan=SHARP_PAN,
                    read=partial(panning, seed, SHARP_PAN), scored=range(FIRST_SCORED, 10))
          for seed in MADE_SEEDS),
        *(synthetic('made, object appears', f'seed {seed}', read=partial(appearing, seed),
                    noise=2, scored=range(APPEARS, APPEARS + 2)) for seed in MADE_SEEDS)]
    if quick:
        return [one for one in found if one.group in QUICK_KINDS], []
    drives = [(f'{group}, noise {noise}' if noise else group, folder.split('/')[1], KITTI,
               KITTI_DISPARITIES, folder, FRAMES, numbers, noise)
              for noise in (0, KITTI_NOISE) for group, folder, numbers in KITTI_DRIVES]
    drives += [(f'EuRoC, noise {noise}' if noise else 'EuRoC', 'V1_01, flicker only', MIDDLEBURY,
                EUROC_DISPARITIES, EUROC, FRAMES_IN_FOLDERS, EUROC_FRAMES, noise)
               for noise in EUROC_NOISES]
    driven, skipped = [], {} if find_spec('skimage') else {
        'no scikit-image: made, pictured street': None}
    for *named, folder, layout, numbers, noise in drives:
        if data is None or not (data / folder).is_dir():
            skipped[f'no folder: {folder}'] = None      # each once
            continue
        driven.append(ScoredSequence(
            *named, partial(read_frames, data / folder, layout, numbers), noise=noise,
            scored=range(0 if folder == EUROC else len(numbers)),
            camera=read_camera(data / folder / CALIBRATION)))
    still = [one for one in driven if not one.scored]
    return [*(one for one in driven if one.scored), *found, *still], list(skipped)


def window(scene, pan, frames=WINDOW_FRAMES):
    """
    Return frames of a scene seen through a window that moves to the right.

    pan: pixels per frame. Raises ValueError if the scene is too narrow.
    """
    pair = scene.read()
    width = pair.truth.shape[1] - pan * (frames - 1)
    if width < 2:
        raise ValueError(f'{frames} frames at {pan} pixels leave nothing of {scene.path}')
    return [cropped(pair, pair.truth.shape[0], width, pan * frame) for frame in range(frames)]


def cropped(pair, rows, columns, first_column=0, first_row=0):
    """Return a part of a `ScoredPair`; pixels matched outside of it do not count."""
    part = slice(first_row, first_row + rows), slice(first_column, first_column + columns)
    inside = np.arange(columns) - pair.truth[part] >= 0
    counts = inside if pair.counts is None else inside & pair.counts[part]
    return ScoredPair(np.ascontiguousarray(pair.left[part]),
                      np.ascontiguousarray(pair.right[part]), pair.truth[part], counts,
                      whole_pixel=pair.whole_pixel)


def hard_cut(before, after):
    """Return two frames of one scene, then one of another, cropped to the same size."""
    first, second = before.read(), after.read()
    rows, columns = np.minimum(first.truth.shape, second.truth.shape)
    first, second = (cropped(pair, rows, columns) for pair in (first, second))
    return [first, first, second]


def moving(seed, options):
    """Return eight frames of a synthetic scene whose objects move."""
    return [ScoredPair(*made) for made in make_sequence(
        frames=8, seed=seed, objects=5, **MADE, **{**options, 'noise': 0})]


def pictured(seed):
    """Return eight frames of a drive through a street whose planes carry pictures."""
    return [ScoredPair(*made) for made in make_pictured_street(
        *list(MADE.values())[:3], 8, seed, **DRIVE)]


def panning(seed, pan):
    """Return ten frames of objects of sharp texture before a background that pans."""
    return [ScoredPair(*made) for made in make_layers(
        MADE['rows'], MADE['columns'], 10, seed, **SHARP, pan=pan)]


def appearing(seed):
    """Return frames of a synthetic scene in which an object appears at frame APPEARS."""
    # Objects are drawn one after the other: with one seed, five are the same four and one more.
    fewer, more = (list(make_sequence(frames=APPEARS + 2, seed=seed, objects=count, motion=1.0,
                                      **MADE)) for count in (4, 5))
    return [ScoredPair(*made) for made in (*fewer[:APPEARS], *more[APPEARS:])]


def read_camera(path):
    """Return the `Camera` of a calibration file of KITTI: P0 and P1, a line each."""
    left, right = (list(map(float, line.split()[1:])) for line in path.read_text(
        encoding='ascii').splitlines()[:2])
    return Camera(left[0], left[5], left[2], left[6], left[2] - right[2])


def read_frames(folder, layout, numbers):
    """Return the `ScoredPair`s of frames of a folder."""
    return [ScoredPair(**vars(files_of(folder, layout, number)[0].read())) for number in numbers]
