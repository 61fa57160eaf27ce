# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""`fuzzy-stereo match`: match two image files and write a disparity file and a picture."""
import argparse
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
import time

from fuzzy_stereo_ros.commands.shared_options import (
    add_truth_options, as_json, checked_outputs, truth_and_mask, UNTOUCHED)
from fuzzy_stereo_ros.evaluation.scores import score
from fuzzy_stereo_ros.matching import StereoMatcher
from fuzzy_stereo_ros.matching.matcher import checked_pair
from fuzzy_stereo_ros.matching.plausibility import PlausibilityCheck
from fuzzy_stereo_ros.matching.row_offsets import row_offset_in_words
from fuzzy_stereo_ros.matching.search_range import search_range
from fuzzy_stereo_ros.pair_matcher import camera_of, without_missing
from fuzzy_stereo_ros.pairs.calibration import points_reach, reach
from fuzzy_stereo_ros.pairs.disparity_files import (
    check_map_suffix, POINT_SUFFIX, write_confidence, write_depth, write_disparity,
    write_point_file)
from fuzzy_stereo_ros.pairs.image_files import (
    check_image_suffix, check_suffix, read_pair, write_image)
from fuzzy_stereo_ros.pairs.pair_reader import PairReader
from fuzzy_stereo_ros.pairs.stereo_pair import number_of
from fuzzy_stereo_ros.parameters.options import (
    add_camera_options, add_matcher_options, add_node_options, CameraOptions, is_automatic,
    matcher_config, node_rows, option_values, USUAL_PROFILE)
from fuzzy_stereo_ros.saved_pair import comparison, read_saved_pair, sentence
from fuzzy_stereo_ros.views.video import disparity_picture
import numpy as np

ON_INTERRUPT = UNTOUCHED
HELP = 'match two images'
DESCRIPTION = ('Match a rectified pair of images. The disparities are of the image that\n'
               '--reference names; rejected pixels are invalid (see --fill).\n'
               'With --saved: match a saved pair again, and report whether the result is the\n'
               'same bit for bit.')
EXAMPLE = ('examples:\n'
           '  fuzzy-stereo match left.png right.png --disparities 64 --output disparity.pfm \\\n'
           '      --picture disparity.png\n'
           '  fuzzy-stereo match left.png right.png --disparities auto --overwrite\n'
           '  fuzzy-stereo match --saved report')
IN_SAVED_PAIR = 'left', 'right', 'disparities'
USUAL_FILES = {'output': 'disparity.pfm', 'picture': 'disparity.png'}
# Output files, and what checks the suffix of each.
FILES = {'output': check_map_suffix, 'picture': check_image_suffix, 'confidence': check_map_suffix,
         'depth': check_map_suffix, 'points': partial(check_suffix, allowed=[POINT_SUFFIX])}
LIMIT = 'points_max_depth',
METRIC = 'depth', 'points'      # of these, those that need a camera
DIFFERENT = 1       # exit code: the match differs from the saved one


def add_arguments(parser):
    parser.add_argument('left', metavar='LEFT', help='left image, 8 or 16 bits, grey or colour')
    parser.add_argument('right', metavar='RIGHT', help='right image, of the same size')
    parser.add_argument('--saved', metavar='FOLDER', action=_Saved,
                        help='match the pair of this folder with its saved parameters and '
                             'previous frame, but without a deadline; replaces LEFT, RIGHT and '
                             '--disparities; other options change single parameters, --profile '
                             'all but the range')
    parser.add_argument('--output', metavar='FILE',
                        help='file of disparities: .pfm (invalid: inf), .npy (NaN) or .png (16 '
                             'bits as KITTI, invalid: 0). Without any output and --saved: '
                             f"{' and '.join(USUAL_FILES.values())}")
    parser.add_argument('--picture', metavar='FILE',
                        help='picture in colours below a legend: far is blue, near red, invalid '
                             'hatched')
    parser.add_argument('--confidence', metavar='FILE',
                        help='file of confidence, 0 to 1: .pfm, .npy or .png (0 to 255)')
    parser.add_argument('--depth', metavar='FILE',
                        help='file of depth in metres: .pfm, .npy, or .png (16 bits, millimetres, '
                             'invalid: 0); with --calibration, or --focal and --baseline')
    parser.add_argument('--points', metavar='FILE',
                        help='.ply of the points in metres with their colours; as --depth')
    parser.add_argument('--overwrite', action='store_true', help='replace files that exist')
    parser.add_argument('--json', action='store_true', help='print the figures as JSON')
    parser.add_argument('--rectify', action='store_true',
                        help='the images are raw: rectify them by --calibration')
    add_camera_options(parser)
    add_node_options(parser, 'files of points', LIMIT)
    add_truth_options(parser)
    add_matcher_options(parser, automatic=True)
    parser.set_defaults(profile=None)       # --saved depends on whether it is given


class _Saved(argparse.Action):
    """The option --saved, which makes the other arguments optional."""

    def __call__(self, parser, namespace, values, option_string=None):
        setattr(namespace, self.dest, values)
        parser.waive(*IN_SAVED_PAIR)


def run(arguments, stream):
    """Match, write the files, print the figures, and return the exit code."""
    saved, automatic, inputs, known = None, False, [arguments.ground_truth, arguments.mask], {}
    cameras, settings = CameraOptions.of(arguments), option_values(arguments, node_rows(LIMIT))
    if arguments.saved is None:
        if any(Path(path).is_dir() for path in (arguments.left, arguments.right)):
            raise ValueError('match takes two images; for folders, videos and bags there is '
                             f'fuzzy-stereo replay {arguments.left} {arguments.right} --output '
                             'matched')
        arguments.profile = arguments.profile or USUAL_PROFILE
        automatic = is_automatic(arguments)
        config = matcher_config(arguments)
        inputs += arguments.left, arguments.right, *(arguments.calibration or ())
        images, infos = read_pair(arguments.left, arguments.right), (None, None)
        if arguments.rectify or cameras.given:
            infos, _ = cameras.cameras(images[0].shape[:2], 'depth', arguments.rectify,
                                       (arguments.left, arguments.right))
        pair = PairReader(arguments.rectify).read_images(images, infos)
    elif arguments.rectify or cameras.given:
        raise ValueError('--saved has rectified images and their calibration; leave out --rectify '
                         'and the options of cameras')
    elif any(getattr(arguments, name, None) is not None for name in IN_SAVED_PAIR):
        raise ValueError('--saved has the images and the number of disparities; leave out LEFT, '
                         'RIGHT and --disparities')
    else:
        saved = read_saved_pair(arguments.saved)
        config = matcher_config(arguments, saved.repeatable)
        inputs += Path(arguments.saved).iterdir()
        pair, known = saved.pair, {'stamp': saved.pair.stamp}
    left, right = pair.left, pair.right
    truth, mask = truth_and_mask(arguments, left.shape[:2])
    if saved is None and all(getattr(arguments, name) is None for name in FILES):
        vars(arguments).update(USUAL_FILES)
        there = [str(Path(name).resolve()) for name in USUAL_FILES.values() if Path(name).exists()]
        if there and not arguments.overwrite:
            raise ValueError(f"without --output the result is written to {' and '.join(there)}, "
                             'which there is already; give --overwrite to replace it, or --output')
    outputs = checked_outputs(arguments, FILES, inputs)
    _check_metric([name for name in METRIC if name in outputs], pair.calibration, config)
    if automatic:
        first, count = search_range([(left, right)], config.threads)
        config = replace(config, min_disparity=first, disparities=count)
    checked_pair(left, right, config)       # before kernels are compiled
    matcher = StereoMatcher(config)
    matcher.warm_up(*left.shape[:2])
    if saved is not None:
        matcher.restore(saved.state, saved.rows)
    start = time.perf_counter()
    match = matcher.match(left, right, camera=camera_of(pair), **known)
    milliseconds = 1000 * (time.perf_counter() - start)
    match = without_missing(match, pair.missing, config.reference)
    finding = PlausibilityCheck().add(
        left, right, match, config,
        pair.calibration.offset if automatic or pair.calibration.focal else None)
    if 'output' in outputs:
        write_disparity(outputs['output'], match.disparity)
    if 'picture' in outputs:
        write_image(outputs['picture'], disparity_picture(match.disparity))
    if 'confidence' in outputs:
        write_confidence(outputs['confidence'], match.confidence)
    if 'depth' in outputs:
        write_depth(outputs['depth'], match.depth(pair.calibration))
    farthest = pair.calibration.points_limit(settings['points_max_depth'])
    if 'points' in outputs:
        write_point_file(outputs['points'], match.depth(pair.calibration), pair.calibration.left,
                         left, farthest)
    figures = {
        **{name: str(path) for name, path in outputs.items()},
        'profile': arguments.profile,
        'rows': left.shape[0],
        'columns': left.shape[1],
        'disparities': config.disparities,
        'min_disparity': config.min_disparity,
        'assumed': saved is None and not hasattr(arguments, 'disparities') and not automatic,
        'reach': reach(config.min_disparity, config.disparities, pair.calibration),
        'points_reach': points_reach(farthest) if 'points' in outputs else '',
        'reference': config.reference,
        'time_ms': milliseconds,
        'times': dict(match.times),
        'generations': match.generations,
        'density': 100 * float(np.isfinite(match.disparity).mean()),
        'mean_confidence': float(match.confidence.mean()),
        'ground_truth': None if truth is None else asdict(score(match.disparity, truth, mask)),
        'remarks': list(pair.calibration.remarks),
        'hint': finding and finding._asdict(),
        'misalignment': match.misalignment and match.misalignment.record,
        'row_offset': row_offset_in_words(match.misalignment),
    }
    if saved is not None:
        figures['saved'] = {'folder': arguments.saved, **comparison(saved, config, match)}
    print(as_json(figures) if arguments.json else _sentences(figures), file=stream)
    found = figures.get('saved', {'same': True})
    return 0 if found['same'] or found['changed'] else DIFFERENT


def _check_metric(names, calibration, config):
    """Raise ValueError if outputs in metres are asked for, but the camera or its image is not."""
    if names and not calibration.baseline:
        raise ValueError(f'--{names[0]} needs a baseline: ' + ('; '.join(
            calibration.remarks) or 'give --calibration, or --focal and --baseline'))
    if names and config.reference != 'left':
        raise ValueError(f'--{names[0]} is of the left image; leave out --reference')


def _sentences(figures):
    saved = figures.get('saved')
    settings = f"profile {figures['profile']}" if saved is None else 'parameters as saved'
    if saved is not None and saved['changed']:
        settings += ' but for ' + ', '.join(saved['changed'])
    searched = figures['reach'] or '{min_disparity} to {last} px'.format(
        **figures, last=figures['min_disparity'] + figures['disparities'] - 1)
    if figures['assumed']:
        searched += ', the default; --disparities auto finds the range'
    files = [(name, figures[name]) for name in FILES if name in figures]
    named = files.pop(0)[1] if files else saved['folder']
    lines = [
        f"{named}: {figures['columns']}x{figures['rows']} "
        f"pixels of the {figures['reference']} image, {figures['density']:.1f} % with a disparity",
        f"matched in {figures['time_ms']:.1f} ms (generations: {figures['generations']}, "
        f'{settings}, without compile time)',
        *([f'searched: {searched}'] if saved is None else [])]
    lines[1:1] = [f"{path}: {'the same in colours' if name == 'picture' else name}"
                  for name, path in files]
    found = figures['ground_truth']
    if found is not None:
        lines.append(_sentence_on(found))
    lines += filter(None, [figures['points_reach']])
    lines += [f'remark: {remark}' for remark in figures['remarks']]
    if figures['hint'] is not None:
        lines.append(f"hint: {figures['hint']['sentence']}")
    lines.append(f"row offset: {figures['row_offset']}")
    if saved is not None:
        lines.append(sentence(saved))
    return '\n'.join(lines)


def _sentence_on(score):
    pixels = f"{number_of(score['pixels'], 'pixel')} with ground truth"
    if not score['pixels']:
        return 'no pixel has ground truth'
    if score['density'] == 0:
        return f'none of {pixels} has a disparity'
    return (f"of {pixels} {score['density']:.1f} % have a disparity; off by more than 1 px are "
            f"{score['bad_sparse'][1.0]:.2f} % of these, off or invalid "
            f"{score['bad_dense'][1.0]:.2f} % of all; "
            f"average error {score['average_error']:.2f} px")
