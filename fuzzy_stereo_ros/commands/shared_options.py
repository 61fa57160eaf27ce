# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Shared parts of commands: ground truth, checks of outputs, figures as JSON."""
import json
import math
from pathlib import Path

from fuzzy_stereo_ros.evaluation.ground_truth import read_mask
from fuzzy_stereo_ros.pairs.disparity_files import read_disparity
from fuzzy_stereo_ros.pairs.image_files import check_place
from fuzzy_stereo_ros.pairs.stereo_pair import width_by_height

# What an interruption leaves behind, of commands that write whole files at their end.
UNTOUCHED = 'no file is half written; one that is not written yet is as before'


def add_truth_options(parser):
    """Add the options of `truth_and_mask`."""
    truth = parser.add_argument_group('comparison with ground truth')
    truth.add_argument('--ground-truth', metavar='FILE',
                       help='disparities of the image that --reference names: .pfm, .npy, .npz, '
                            'or a picture (invalid: 0)')
    truth.add_argument('--ground-truth-scale', metavar='NUMBER', type=float,
                       help='grey levels per pixel of disparity in a picture; default for '
                            '16 bits: 256')
    truth.add_argument('--mask', metavar='FILE', help='picture; only pixels of 255 count')


def truth_and_mask(arguments, shape):
    """Return truth, float32 (R, C), and mask, bool (R, C), or None; ValueError if misshapen."""
    if arguments.ground_truth is None:
        for name in ('ground_truth_scale', 'mask'):
            if getattr(arguments, name) is not None:
                raise ValueError(f"--{name.replace('_', '-')} needs --ground-truth")
        return None, None
    truth = read_disparity(arguments.ground_truth, arguments.ground_truth_scale)
    mask = None if arguments.mask is None else read_mask(arguments.mask)
    for path, array in ((arguments.ground_truth, truth), (arguments.mask, mask)):
        if array is not None and array.shape != shape:
            raise ValueError(f'{path} is {width_by_height(array)}, the images are '
                             f'{shape[1]}x{shape[0]}')
    return truth, mask


def checked_outputs(arguments, checks, inputs=()):
    """
    Return {option: Path} of the output files that are given.

    checks: {option: check(path)}, which raises ValueError for a suffix that is not allowed;
    inputs: paths that no output may replace, None among them is left out. Raises ValueError too
    if two files are one, if a folder is missing, or if a file exists without --overwrite.
    """
    outputs = {name: Path(getattr(arguments, name)) for name in checks
               if getattr(arguments, name) is not None}
    taken = {Path(path).resolve(): 'an input' for path in inputs if path is not None}
    for name, path in outputs.items():
        check_place(path)
        if path.resolve() in taken:
            raise ValueError(f'--{name} is {path}, which is also {taken[path.resolve()]}')
        taken[path.resolve()] = f'--{name}'
        checks[name](path)
        if path.exists() and not arguments.overwrite:
            raise ValueError(f'--{name} is {path}, which exists; give --overwrite to replace it, '
                             'or name another file')
    return outputs


def as_json(figures):
    """Return the text of figures, those of `for_json`."""
    return json.dumps(for_json(figures), indent=2)


def for_json(figures):
    """Return figures for JSON: keys as strings, NaN and infinity as None."""
    if isinstance(figures, dict):
        return {str(name): for_json(value) for name, value in figures.items()}
    if isinstance(figures, (list, tuple)):
        return [for_json(value) for value in figures]
    if isinstance(figures, float) and not math.isfinite(figures):
        return None
    return figures
