# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""`fuzzy-stereo convert`: convert files of disparities and depth, also to point clouds."""
from pathlib import Path

from fuzzy_stereo_ros.commands.shared_options import as_json, UNTOUCHED
from fuzzy_stereo_ros.pairs.calibration import disparity_of, points_reach, read_calibration
from fuzzy_stereo_ros.pairs.disparity_files import (
    check_map_suffix, POINT_SUFFIX, read_depth, read_disparity, write_depth, write_disparity,
    write_point_file)
from fuzzy_stereo_ros.pairs.image_files import check_place, read_image
from fuzzy_stereo_ros.pairs.stereo_pair import number_of, width_by_height
from fuzzy_stereo_ros.parameters.options import (
    add_camera_options, add_node_options, CameraOptions, node_rows, option_name,
    option_values)
import numpy as np

DISPARITY, DEPTH, POINTS = 'disparity', 'depth', 'points'
LIMIT = 'points_max_depth',
READ = {DISPARITY: read_disparity, DEPTH: read_depth}

ON_INTERRUPT = UNTOUCHED
HELP = 'convert disparities and depth, also to point clouds'
DESCRIPTION = (
    'Convert a file of disparities or depth into another format, into the other quantity, or\n'
    'into a point cloud. The suffix sets the format, --from and --to the quantities.\n\n'
    '             disparity, px              depth, m\n'
    '  .pfm       invalid: inf               invalid: NaN, too far: inf\n'
    '  .npy       invalid: NaN               invalid: NaN, too far: inf\n'
    '  .png       256ths of a pixel (KITTI)  millimetres; both: 16 bits, invalid: 0\n'
    '  .ply                                  output only: points x right, y down, z forward, m\n\n'
    'INPUT may also be a .npz with one array, or a picture of another scale (--scale).')
EXAMPLE = ('examples:\n'
           '  fuzzy-stereo convert disparity.pfm disparity.png\n'
           '  fuzzy-stereo convert disparity.pfm depth.png --to depth --calibration calib.txt\n'
           '  fuzzy-stereo convert disparity.npy cloud.ply --focal 576 --baseline 0.12 \\\n'
           '      --image left.png')


def add_arguments(parser):
    parser.add_argument('input', metavar='INPUT', help='.pfm, .npy, .npz, or a picture')
    parser.add_argument('output', metavar='OUTPUT', help='.pfm, .npy, .png or .ply')
    parser.add_argument('--from', dest='source', choices=tuple(READ), default=DISPARITY,
                        help=f'quantity of INPUT; default: {DISPARITY}')
    parser.add_argument('--to', choices=(DISPARITY, DEPTH, POINTS),
                        help=f'quantity of OUTPUT; default: {POINTS} for {POINT_SUFFIX}, else '
                             'that of INPUT')
    parser.add_argument('--scale', type=float, metavar='NUMBER',
                        help='if INPUT is a picture: grey levels per pixel of disparity, or per '
                             'metre of depth; default for 16 bits: 256, or 1000')
    parser.add_argument('--image', metavar='FILE',
                        help=f'left image, for the colours of {POINT_SUFFIX}')
    parser.add_argument('--overwrite', action='store_true', help='replace OUTPUT where it exists')
    parser.add_argument('--json', action='store_true', help='print the figures as JSON')
    add_camera_options(parser)
    add_node_options(parser, 'files of points', LIMIT)


def run(arguments, stream):
    """Convert a file and print the figures of the result."""
    target = arguments.to or (POINTS if _is_points(arguments.output) else arguments.source)
    cameras, settings = CameraOptions.of(arguments), option_values(arguments, node_rows(LIMIT))
    _check_output(arguments, target, cameras)
    values, remarks = READ[arguments.source](arguments.input, arguments.scale), ()
    if target != arguments.source:
        needed = 'focal', 'baseline'
        if (arguments.source, target) == (DEPTH, POINTS):
            needed = needed[:1]
        purpose = f'{target} from {arguments.source}'
        calibration = read_calibration(*cameras.cameras(values.shape, purpose, needed=needed)[0])
        remarks = calibration.remarks
        if not calibration.baseline:
            *remarks, lacking = remarks
            if 'baseline' in needed:
                raise ValueError(f'{purpose} needs a baseline: {lacking}')
        if arguments.source == DISPARITY:
            values = calibration.depth(values)
        elif target == DISPARITY:
            values = disparity_of(values, calibration)
    if target == POINTS:
        image = None if arguments.image is None else read_image(arguments.image)
        if image is not None and image.shape[:2] != values.shape:
            raise ValueError(f'{arguments.image} is {width_by_height(image)}, but there are '
                             f'{width_by_height(values)} pixels')
        farthest = calibration.points_limit(settings['points_max_depth'])
        remarks = [*remarks, *filter(None, [points_reach(farthest)])]
        values[values > farthest] = np.nan
        write_point_file(arguments.output, values, calibration.left, image)
    else:
        {DISPARITY: write_disparity, DEPTH: write_depth}[target](arguments.output, values)
        values = READ[target](arguments.output)     # a format may be less precise
    figures = {**_figures(arguments, target, values), 'remarks': remarks}
    stream.write((as_json(figures) if arguments.json else _sentence(figures)) + '\n')


def _is_points(path):
    return Path(path).suffix.lower() == POINT_SUFFIX


def _check_output(arguments, target, cameras):
    output = Path(arguments.output)
    if _is_points(arguments.input):
        raise ValueError(f'{arguments.input} is a point cloud, which has no pixels; convert the '
                         'disparities or the depth that it was made from')
    if (target == POINTS) != _is_points(output):
        raise ValueError(f'{output} cannot hold {target}: {POINT_SUFFIX} is for points, and only '
                         'for them')
    if target != POINTS:
        check_map_suffix(output, f', and {POINT_SUFFIX} for points')
        if arguments.image is not None:
            raise ValueError(f'--image is for the colours of {POINT_SUFFIX}, but {output} holds '
                             f'{target}; leave it out')
    if target == arguments.source and cameras.given:
        other = next(kind for kind in READ if kind != target)
        raise ValueError(f'{option_name(cameras.given[0])} has no effect: {output} is to hold '
                         f'{target}, as {arguments.input} does; give --to {other}, or leave it '
                         'out')
    check_place(output)
    if output.resolve() in (Path(path).resolve() for path in (
            arguments.input, arguments.image, *(arguments.calibration or ())) if path):
        raise ValueError(f'{output} is an input too; name another file')
    if output.exists() and not arguments.overwrite:
        raise ValueError(f'{output} exists; give --overwrite to replace it, or name another file')


def _figures(arguments, target, values):
    valid = values[np.isfinite(values)]
    return {
        'output': arguments.output, 'from': arguments.source, 'to': target,
        'rows': values.shape[0], 'columns': values.shape[1], 'valid': valid.size,
        'low': float(valid.min()) if valid.size else None,
        'high': float(valid.max()) if valid.size else None,
        'unit': 'px' if target == DISPARITY else 'm'}


def _sentence(figures):
    what = {DISPARITY: ('disparity', 'disparities'), DEPTH: ('depth',), POINTS: ('point',)}[
        figures['to']]
    between = '' if figures['low'] is None else (
        f", from {figures['low']:.6g} to {figures['high']:.6g} {figures['unit']}"
        + (' away' if figures['to'] == POINTS else ''))
    return '\n'.join((
        f"{figures['output']}: {number_of(figures['valid'], *what)} of {figures['columns']}x"
        f"{figures['rows']} pixels{between}",
        *(f'remark: {remark}' for remark in figures['remarks'])))
