# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Parts of several commands: options of ground truth, checks of outputs, figures as JSON."""
from contextlib import ExitStack
import math
from pathlib import Path

from fuzzy_stereo_ros.matching import StereoMatcher, WARM_UP_SIZE
from fuzzy_stereo_ros.matching.compiling import warm_up
from fuzzy_stereo_ros.pairs.disparity_files import read_disparity
from fuzzy_stereo_ros.pairs.image_files import read_image
from fuzzy_stereo_ros.progress import bar


def warm_matcher(config, stream, shape=WARM_UP_SIZE, always=False):
    """
    Return a StereoMatcher that is warm for images of a shape.

    A bar shows on a text stream what is compiled, where that is a terminal, or always.
    """
    matcher, bars = StereoMatcher(config), []
    with ExitStack() as opened:
        def report(progress):
            if not bars:
                bars.append(opened.enter_context(bar(
                    stream, always, total=100, desc='compiling the kernels',
                    bar_format='{l_bar}{bar}| {elapsed}<{remaining}')))
            bars[0].update(100 * progress.share - bars[0].n)

        warm_up(matcher, *shape, report if always or stream.isatty() else None)
    return matcher


def add_truth_options(parser):
    """Add --ground-truth and what belongs to it, for read_truth."""
    truth = parser.add_argument_group('comparison with ground truth')
    truth.add_argument('--ground-truth', metavar='FILE',
                       help='disparities of the image that --reference names: .pfm, .npy, .npz, '
                            'or a picture (0 is invalid)')
    truth.add_argument('--ground-truth-scale', metavar='NUMBER', type=float,
                       help='grey levels per pixel of disparity in a picture; default for '
                            '16 bits: 256')
    truth.add_argument('--mask', metavar='FILE', help='picture; only pixels of 255 count')


def read_truth(arguments, shape):
    """
    Return ground truth, float32 (R, C), and mask, bool (R, C), of parsed options.

    None stands for what is not given. Raises ValueError where the size differs from the shape.
    """
    if arguments.ground_truth is None:
        for name in ('ground_truth_scale', 'mask'):
            if getattr(arguments, name) is not None:
                raise ValueError(f"--{name.replace('_', '-')} needs --ground-truth")
        return None, None
    truth = read_disparity(arguments.ground_truth, arguments.ground_truth_scale)
    mask = None if arguments.mask is None else read_image(arguments.mask)
    if mask is not None:
        mask = (mask if mask.ndim == 2 else mask[:, :, 0]) == 255
    for path, array in ((arguments.ground_truth, truth), (arguments.mask, mask)):
        if array is not None and array.shape != shape:
            raise ValueError(f'{path} is {array.shape[1]}x{array.shape[0]}, the images are '
                             f'{shape[1]}x{shape[0]}')
    return truth, mask


def checked_outputs(arguments, checks, inputs=()):
    """
    Return {option without --: Path} of the files that parsed arguments have written.

    checks: {option: function that raises ValueError for a path of a wrong kind}. inputs: paths;
    None among them is ignored.
    Raises ValueError where one has no folder, or is one, an input or another output; and where it
    exists, if the command has --overwrite, and that is not given.
    """
    outputs = {name: Path(getattr(arguments, name)) for name in checks
               if getattr(arguments, name) is not None}
    taken = {Path(path).resolve(): 'an input' for path in inputs if path is not None}
    for name, path in outputs.items():
        if not path.parent.is_dir():
            raise ValueError(f'--{name} is {path}, but there is no folder {path.parent}')
        if path.is_dir():
            raise ValueError(f'--{name} is {path}, which is a folder; name a file')
        if path.resolve() in taken:
            raise ValueError(f'--{name} is {path}, which is {taken[path.resolve()]} too')
        taken[path.resolve()] = f'--{name}'
        checks[name](path)
        if path.exists() and not getattr(arguments, 'overwrite', True):
            raise ValueError(f'--{name} is {path}, which exists; give --overwrite to replace it, '
                             'or name another file')
    return outputs


def for_json(figures):
    """Return figures as JSON can hold them: names as strings, NaN and infinite as null."""
    if isinstance(figures, dict):
        return {str(name): for_json(value) for name, value in figures.items()}
    if isinstance(figures, (list, tuple)):
        return [for_json(value) for value in figures]
    if isinstance(figures, float) and not math.isfinite(figures):
        return None
    return figures
