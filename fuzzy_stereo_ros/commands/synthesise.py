# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""`fuzzy-stereo synthesise`: write a synthetic stereo sequence with exact ground truth."""
from pathlib import Path
import shlex
import sys
import tempfile

from fuzzy_stereo_ros.bags.reading import text_of
from fuzzy_stereo_ros.bags.writing import is_sequence_bag, write_sequence_bag
from fuzzy_stereo_ros.commands.shared_options import as_json
from fuzzy_stereo_ros.pairs.camera_files import (
    rectified_cameras, write_camera, write_middlebury_calibration)
from fuzzy_stereo_ros.pairs.disparity_files import write_disparity
from fuzzy_stereo_ros.pairs.image_files import write_image
from fuzzy_stereo_ros.pairs.stereo_pair import number_of
from fuzzy_stereo_ros.parameters.options import add_options, option_values
from fuzzy_stereo_ros.progress import bar
from fuzzy_stereo_ros.synthetic.scenes import scene_calibration, scene_pairs, SCENE_PARAMETERS
import numpy as np

FORMATS = 'images', 'bag'
FILES = {'left', 'right', 'truth', 'visible', 'calib.txt', 'left.yaml', 'right.yaml'}

ON_INTERRUPT = 'the folder is as before'
HELP = 'make a synthetic stereo sequence with exact ground truth'
DESCRIPTION = (
    'Make a synthetic stereo sequence with exact ground truth: slanted textured surfaces, thin\n'
    'objects, occlusion, moving cameras and objects, noise and exposure, each by an option. The\n'
    'same options give the same images in both formats.\n\n'
    '  images  left/0000.png, right/0000.png, truth/0000.pfm (disparities of the left image),\n'
    '          visible/0000.png (255 where both cameras see the same point), ..., and the\n'
    "          cameras: calib.txt as Middlebury 2014's, left.yaml and right.yaml for ROS\n"
    '  bag     a ROS 2 bag (mcap): image_rect and camera_info of /left and of /right')
EXAMPLE = ('examples:\n'
           '  fuzzy-stereo synthesise --output scene --frames 20 --poles 3\n'
           '  fuzzy-stereo synthesise --output scene_bag --format bag --noise 6 --flicker 0.2')


def add_arguments(parser):
    parser.add_argument('--output', metavar='DIR', required=True,
                        help='new folder; it is written completely or not at all')
    parser.add_argument('--format', choices=FORMATS, default=FORMATS[0],
                        help=f'default: {FORMATS[0]}')
    parser.add_argument('--overwrite', action='store_true',
                        help='replace DIR if it holds a synthetic sequence')
    parser.add_argument('--json', action='store_true',
                        help='print the options of the sequence as JSON')
    add_options(parser.add_argument_group('the scene and the cameras'), SCENE_PARAMETERS.values())


def run(arguments, stream, progress_stream=None):
    """Write the sequence and print a description."""
    values = option_values(arguments, SCENE_PARAMETERS.values())
    pairs = bar(progress_stream or sys.stderr, iterable=scene_pairs(values),
                total=values['frames'], desc='synthesise')
    target = Path(arguments.output).resolve()
    _check_target(arguments.output, target, arguments.overwrite)
    try:
        with tempfile.TemporaryDirectory(
                prefix=f'.{target.name}.', suffix='.part', dir=target.parent) as part:
            complete = Path(part) / target.name     # a folder with the usual permissions
            if arguments.format == 'bag':
                write_sequence_bag(complete, ((pair.left, pair.right) for pair in pairs),
                                   scene_calibration(values), values['rate'])
            else:
                _write_images(complete, pairs, values)
            before = Path(part) / f'{target.name}.before'
            if target.is_dir():
                target.replace(before)
            try:
                complete.replace(target)
            except BaseException:
                if before.is_dir():
                    before.replace(target)
                raise
    except OSError as error:
        reason = text_of(error.__cause__ or error)      # a bag's error names the unfinished folder
        raise OSError(f'{arguments.output} cannot be written: {reason}; give a writable folder on '
                      'a disk with enough space') from error
    if arguments.json:
        stream.write(as_json({
            'output': arguments.output, 'format': arguments.format, **values}) + '\n')
    else:
        stream.write(_sentences(arguments.output, arguments.format, values) + '\n')


def _check_target(name, target, overwrite):
    if not target.parent.is_dir():
        raise ValueError(f'--output is {name}, but there is no folder {target.parent}')
    if target.exists() and not target.is_dir():
        raise ValueError(f'--output is {name}, which is a file; name a folder')
    there = {entry.name for entry in target.iterdir()} if target.exists() else set()
    if there and not overwrite:
        raise ValueError(f'--output is {name}, which exists; give --overwrite to replace it, or '
                         'name another folder')
    if there and there != FILES and not is_sequence_bag(target):
        raise ValueError(f'--output is {name}, which holds other files than a synthetic sequence; '
                         'name another folder')


def _write_images(folder, pairs, values):
    for name in ('left', 'right', 'truth', 'visible'):
        (folder / name).mkdir(parents=True)
    for number, pair in enumerate(pairs):
        write_image(folder / 'left' / f'{number:04}.png', pair.left)
        write_image(folder / 'right' / f'{number:04}.png', pair.right)
        write_image(folder / 'visible' / f'{number:04}.png', pair.visible * np.uint8(255))
        write_disparity(folder / 'truth' / f'{number:04}.pfm', pair.truth)
    calibration, size = scene_calibration(values), (values['rows'], values['columns'])
    write_middlebury_calibration(folder / 'calib.txt', calibration, size,
                                 values['min_disparity'], values['disparities'])
    for side, camera in rectified_cameras(calibration, *size).items():
        write_camera(folder / f'{side}.yaml', camera, f'made/{side}')


def _sentences(target, form, values):
    made = (f"{target}: {number_of(values['frames'], 'pair')} of "
            f"{values['columns']}x{values['rows']} pixels, "
            f"{number_of(values['disparities'], 'disparity', 'disparities')} from "
            f"{values['min_disparity']} px")
    if form == 'bag':
        return (f'{made}, at {values["rate"]:g} pairs/s\n'
                'for its ground truth give the same options with --format images')
    left, right, truth, visible = (
        shlex.quote(f'{target}/{name}') for name in (
            'left/0000.png', 'right/0000.png', 'truth/0000.pfm', 'visible/0000.png'))
    return (f'{made}\nmatch the first: fuzzy-stereo match {left} {right} '
            f"--disparities {values['disparities']} --min-disparity {values['min_disparity']} "
            f'--ground-truth {truth} --mask {visible} --output disparity.pfm')
