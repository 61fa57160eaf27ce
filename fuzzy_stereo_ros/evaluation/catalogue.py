# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The catalogue of scenes and sequences, recognised by the files in their folders.

To add a data set, add a line to LAYOUTS.
"""
from collections.abc import Callable
from dataclasses import dataclass, field, replace
import os
from pathlib import Path
import re
from typing import NamedTuple

from fuzzy_stereo_ros.evaluation.ground_truth import (
    ALL, DISC, KITTI, LIMITS, MIDDLEBURY, NONOCC, NUMBERS, PairFiles)
from fuzzy_stereo_ros.matching import MatcherConfig

PICTURES = ('.png', '.ppm', '.pgm', '.jpg', '.jpeg', '.bmp', '.tif', '.tiff')
EVERY, VISIBLE = ('disp_occ', 'disp_occ_0'), ('disp_noc', 'disp_noc_0')     # KITTI's
TRUTHS = ('groundtruth', 'truth', *EVERY, *VISIBLE)
MASKS = {NONOCC: (NONOCC, 'nonocc_derived', 'visible', 'mask0nocc'), ALL: (ALL,), DISC: (DISC,)}
INFO = re.compile(r'\s*(\d+)\s+(\d+)\s*')
NDISP = re.compile(r'^ndisp\s*=\s*(\d+)', re.MULTILINE)
NUMBER = re.compile(r'(.*?)_?(\d+)')


@dataclass(frozen=True)
class Scene:
    """A pair with ground truth; `read()` returns its `GroundTruthPair`."""

    group: str  # of the benchmarks, '' for others
    name: str
    family: str  # MIDDLEBURY or KITTI, whose tuned settings the baselines take
    disparities: int | None  # number to search from 0, None = not known
    read: Callable
    source: str = ''  # of this number, in words
    layout: str = ''
    files: dict = field(default_factory=dict, hash=False)  # {number of a frame: `PairFiles`}

    @property
    def limit(self):
        return LIMITS[self.family]

    @property
    def path(self):
        return '/'.join(filter(None, (self.group, self.name)))

    @property
    def named_files(self):
        """The `PairFiles` of the frames, {path and number: files}."""
        return {'/'.join(filter(None, (self.path, number))): files
                for number, files in self.files.items()}


class Sequence(Scene):
    """Consecutive frames; `read()` returns an iterable of their `GroundTruthPair`s."""


class Layout(NamedTuple):
    """The file names of a data set, without suffixes; * stands for the number of a frame."""

    name: str
    left: str
    right: str
    pattern: str = '{}'  # of all but the two images; {} stands for the name
    truths: tuple = TRUTHS  # of the left image; the first existing one counts
    right_truth: str = ''  # of the right image


ONE_PAIR = Layout('left, right and groundtruth', 'left', 'right')
FRAMES = Layout('numbered frames', 'left_*', 'right_*', '{}_*')
FRAMES_IN_FOLDERS = Layout('numbered frames', 'left/*', 'right/*', '{}/*')
# In this order: sets of 2001 have an im0 and an im1 too, which have no truth.
LAYOUTS = (
    Layout('Middlebury v2', 'im2', 'im6', truths=('disp2',), right_truth='disp6'),
    Layout('Middlebury v2', 'view1', 'view5', truths=('disp1',), right_truth='disp5'),
    Layout('Middlebury 2014', 'im0', 'im1', truths=('disp0GT', 'disp0'), right_truth='disp1'),
    Layout('KITTI 2015', 'image_2/*', 'image_3/*', '{}/*', (EVERY[1], VISIBLE[1])),
    Layout('KITTI 2012', 'image_0/*', 'image_1/*', '{}/*', (EVERY[0], VISIBLE[0])),
    Layout('KITTI 2012', 'colored_0/*', 'colored_1/*', '{}/*', (EVERY[0], VISIBLE[0])),
    ONE_PAIR, FRAMES_IN_FOLDERS, FRAMES)
KNOWN = '; '.join(f'{layout.name} ({layout.left}, {layout.right}, '
                  f'{layout.pattern.format(layout.truths[0])})' for layout in LAYOUTS)


class NoTruth(ValueError):
    """There are images, but no ground truth; the text is a sentence for the user."""


class FoundScenes(NamedTuple):
    """The found scenes and sequences, and sentences about folders without a truth."""

    scenes: list
    sequences: list
    skipped: list


def search(folders, truth_scale=None, only='', with_truth=True):
    """Return the `FoundScenes` below folders, paths, named with a word; ValueError if none is."""
    found, skipped = {}, []
    for folder in folders:
        if not folder.is_dir():
            raise ValueError(f'there is no folder {folder}')
        below, without_truth = _below(folder, truth_scale, set(), with_truth)
        if not below:
            raise ValueError(without_truth[0] if without_truth else
                             f'there is no scene below {folder}; known layouts are {KNOWN}')
        found.update({(type(each), place.resolve()): (place, each) for place, each in below})
        skipped += without_truth
    places = [Path(os.path.abspath(place)) for place, _ in found.values()]
    above = os.path.commonpath([place.parent for place in places])
    every = [replace(each, name=place.relative_to(above).as_posix())
             for place, (_, each) in zip(places, found.values())]
    named = [each for each in every if only in each.name]
    if not named:
        raise ValueError(f"--only is '{only}', which no scene has in its name; there are "
                         f'{", ".join(dict.fromkeys(each.name for each in every))}')
    sequences = [each for each in named if isinstance(each, Sequence)]
    scenes = [each for each in named if not isinstance(each, Sequence)]
    for scene in scenes if with_truth else ():
        scene.files[''].check_scale()
    return FoundScenes(scenes, sequences, skipped)


def _below(folder, truth_scale, seen, with_truth):
    """Return [(place, scene or sequence)] in a folder or else below it, and what is skipped."""
    if folder.resolve() in seen:        # a link to a folder above
        return [], []
    seen.add(folder.resolve())
    try:
        found = next(filter(None, (
            _found(folder, layout, truth_scale, with_truth) for layout in LAYOUTS)), [])
    except NoTruth as without:
        return [], [str(without)]
    skipped = []
    for inner in [] if found else sorted(folder.iterdir()):
        if inner.is_dir() and not inner.name.startswith('.'):
            for every, more in zip((found, skipped), _below(
                    inner, truth_scale, seen, with_truth)):
                every += more
    return found, skipped


def _found(folder, layout, truth_scale, with_truth):
    """Return [(place, scene or sequence)] of a layout in a folder; NoTruth, ValueError."""
    found, runs = [], {}
    for number in _numbers(folder, layout):
        files, search_range = files_of(folder, layout, number, truth_scale)
        start, digits = NUMBER.fullmatch(number).groups() if number else ('', '')
        runs.setdefault(start, {})[digits] = files
        if files.truth is not None or not with_truth:
            found.append((folder / number, Scene(
                '', '', files.family, read=files.read, layout=layout.name, files={'': files},
                **search_range)))
    for start, frames in runs.items():
        if len(frames) > 1 and with_truth:
            family = KITTI if any(one.family == KITTI for one in frames.values()) else MIDDLEBURY
            found.append((folder / start, Sequence(
                '', '', family, read=lambda frames=frames: (one.read() for one in frames.values()),
                layout=layout.name, files=frames, **search_range)))
    if runs and not found:
        truth = layout.pattern.format(layout.truths[0])
        raise NoTruth(f'{folder} has images but no ground truth: there is no {truth}')
    return found


def _numbers(folder, layout):
    """Return the numbers (*) of the left images in order, [''] of a layout without numbers."""
    start, star, _ = layout.left.partition('*')
    stems = {path.relative_to(folder).with_suffix('').as_posix().removeprefix(start)
             for path in folder.glob(f'{layout.left}.*')
             if path.suffix.lower() in PICTURES and not path.name.startswith('.')}
    found = [NUMBER.fullmatch(stem) for stem in stems] if star else []
    return [match[0] for match in sorted(filter(None, found), key=lambda match: (
        match[1], int(match[2])))] if star else sorted(stems)[:1] and ['']


def files_of(folder, layout, number='', scale=None):
    """Return a frame's `PairFiles` in a folder, and {'disparities': number, 'source': words}."""
    def first(names, suffixes=PICTURES, pattern=layout.pattern):
        paths = (folder / (pattern.format(name).replace('*', number) + suffix)
                 for name in names for suffix in suffixes)
        return next((path for path in paths if path.is_file()), None)

    left, right = (first([name], pattern='{}') for name in (layout.left, layout.right))
    if right is None:
        missing = folder / (layout.right.replace('*', number) + left.suffix)
        raise ValueError(f'{missing} is missing; {left} has no right image')
    truth = first(layout.truths, (*NUMBERS, *PICTURES))
    masks = {mask: path for mask, names in MASKS.items() if (path := first(names)) is not None}
    levels, disparities, source = scale, None, ''
    info = folder / 'info.txt'      # grey levels per pixel of disparity, largest disparity
    numbers = INFO.fullmatch(info.read_text(encoding='utf-8', errors='replace')
                             ) if info.is_file() and not number else None
    if numbers:
        levels, disparities, source = int(numbers[1]), int(numbers[2]) + 1, info.name
    calibration = folder / 'calib.txt'
    line = NDISP.search(calibration.read_text(encoding='utf-8', errors='replace')
                        ) if calibration.is_file() else None
    if line is not None:
        disparities, source = int(line[1]), 'calib.txt'
        try:
            MatcherConfig(disparities=disparities)
        except ValueError as error:
            raise ValueError(f'{calibration} has {line[0]}: {error}; remove the line or the '
                             'scene') from None
    if truth is not None and truth in (first(EVERY), first(VISIBLE)):
        files = PairFiles(left, right, KITTI, truth, visible_truth=first(VISIBLE), masks=masks)
    else:
        files = PairFiles(left, right, MIDDLEBURY, truth, levels, masks=masks, right_truth=first(
            filter(None, [layout.right_truth]), (*NUMBERS, *PICTURES)))
    return files, {'disparities': disparities, 'source': source}
