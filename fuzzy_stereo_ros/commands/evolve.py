# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""`fuzzy-stereo evolve`: show the generations of a match in numbers, figures and videos."""
from dataclasses import replace
from functools import partial
from importlib.util import find_spec
from pathlib import Path
import sys

from fuzzy_stereo_ros.commands.shared_options import (
    add_truth_options, as_json, checked_outputs, truth_and_mask)
from fuzzy_stereo_ros.evaluation.scores import score
from fuzzy_stereo_ros.matching import StereoMatcher
from fuzzy_stereo_ros.matching.matcher import checked_pair
from fuzzy_stereo_ros.pairs.frames import Frames
from fuzzy_stereo_ros.pairs.image_files import check_suffix, read_pair
from fuzzy_stereo_ros.parameters.options import add_matcher_options, matcher_config
from fuzzy_stereo_ros.progress import bar
from fuzzy_stereo_ros.views.evolution import (
    Course, EvolutionFigure, EvolutionFilm, observe_frames, observe_generations)
from fuzzy_stereo_ros.views.pictures import PANEL_SUFFIXES, write_figure
from fuzzy_stereo_ros.views.video import CODECS

ON_INTERRUPT = 'no file is half written; a video ends with the last generation or frame'
HELP = 'show how disparities evolve'
DESCRIPTION = (
    'Match a rectified pair and show the population, generation by generation: the best\n'
    'chromosome, its possibility and the parents of its genes, the best, mean and worst fitness,\n'
    'and by how much each operator raised it. The result is the one of the command match.\n\n'
    'The images of two folders are the frames of a sequence, in the order of their names: it\n'
    'shows the same frame by frame.')
EXAMPLE = (
    'examples:\n'
    '  fuzzy-stereo evolve left.png right.png --disparities 60 --profile paper \\\n'
    '      --population 40 --generations 10 --picture evolution.png\n'
    '  fuzzy-stereo evolve left.png right.png --disparities 60 --generations 8 \\\n'
    '      --video evolution.mp4\n'
    '  fuzzy-stereo evolve left_frames right_frames --disparities 60 --profile paper_live \\\n'
    '      --picture frames.png --video frames.mp4')
LEFT_OUT = 'deadline_ms', 'warm_start'      # observing takes time; a pair has no previous frame


def add_arguments(parser):
    parser.add_argument('left', metavar='LEFT',
                        help='left image, 8 or 16 bits, grey or colour; or a folder of them')
    parser.add_argument('right', metavar='RIGHT',
                        help='right image of the same size; or a folder of them')
    parser.add_argument('--picture', metavar='FILE',
                        help='some generations or frames in one picture: .png, .svg or .pdf')
    parser.add_argument('--video', metavar='FILE',
                        help='a film of all generations, or of all frames: .mp4 or .avi')
    parser.add_argument('--overwrite', action='store_true', help='replace files that exist')
    parser.add_argument('--json', action='store_true',
                        help='print the figures of all generations or frames as JSON')
    add_truth_options(parser)
    add_matcher_options(parser, left_out=LEFT_OUT)


def run(arguments, stream, progress_stream=None):
    """Match a pair or two folders, write the files, and print the figures."""
    config = matcher_config(arguments)
    folders = [side for side in (arguments.left, arguments.right) if Path(side).is_dir()]
    outputs = checked_outputs(
        arguments, {'picture': partial(check_suffix, allowed=PANEL_SUFFIXES),
                    'video': partial(check_suffix, allowed=CODECS)},
        [arguments.left, arguments.right, arguments.ground_truth, arguments.mask,
         *(file for folder in folders for file in Path(folder).iterdir())])
    if outputs and find_spec('matplotlib') is None:
        raise ValueError(f'--{next(iter(outputs))} needs matplotlib, which is not installed: '
                         'pip install matplotlib')
    pairs = None
    if arguments.left in folders:
        pairs = [frames for _, *frames in Frames([arguments.left, arguments.right]).pairs()]
        config = replace(config, warm_start=True)
    left, right = read_pair(arguments.left, arguments.right) if pairs is None else (
        frame.read() for frame in pairs[0])
    truth, mask = truth_and_mask(arguments, left.shape[:2])
    if truth is not None and not score(truth, truth, mask).pixels:      # no curve can be drawn
        raise ValueError(f'no pixel of {arguments.ground_truth} counts: it has no valid ones, or '
                         '--mask leaves none of them')
    checked_pair(left, right, config)       # before kernels are compiled
    StereoMatcher(config).warm_up(*left.shape[:2])
    course = Course(config, truth, mask, len(pairs or ()), arguments.profile)
    film = EvolutionFilm(outputs['video'], course) if 'video' in outputs else None
    try:
        with bar(progress_stream or sys.stderr, total=course.count + (pairs is None),
                 desc=f'{course.step}s') as shown:
            def observe(snapshot):
                course.add(snapshot)
                if film is not None:
                    film.add()
                shown.update()

            if pairs is None:
                match = observe_generations(config, left, right, observe)
                for row, generation in zip(course.rows[1:], match.history):
                    row.update(gains=generation.gains, milliseconds=generation.milliseconds)
            else:
                observe_frames(config, ([one.read() for one in pair] for pair in pairs), observe)
    finally:
        if film is not None:
            film.close()
    if 'picture' in outputs:
        write_figure(outputs['picture'], EvolutionFigure(course, course.shown).figure)
    figures = {
        **{name: str(path) for name, path in outputs.items()}, 'profile': arguments.profile,
        'rows': left.shape[0], 'columns': left.shape[1],
        **{name: getattr(config, name) for name in (
            'disparities', 'min_disparity', 'reference', 'population', 'generations')},
        f'{course.step}s': course.rows}
    lines = as_json(figures).splitlines() if arguments.json else [
        *_sentences(figures, course), *(f'{path}: written' for path in outputs.values())]
    print('\n'.join(lines), file=stream)


def _sentences(figures, course):
    lines = ['{columns}x{rows} pixels of the {reference} image, profile {profile}, population '
             '{population}'.format(**figures),
             f"{course.step:>10} {'best':>11} {'mean':>11} {'worst':>11}"
             + '  off by more than 1 px [%]' * (course.truth is not None)
             + '  gains, and origin of genes']
    for row in course.rows:
        told = [f'{name} +{gain:.3g}' for name, gain in row.get('gains', {}).items() if gain]
        told += [f'{word} {100 * share:.1f} %' for word, share in row['origins'].items()]
        lines.append(' '.join([
            f"{row['number']:10}", *(f"{row[f'{name}_fitness']:11.5g}" for name in (
                'best', 'mean', 'worst')),
            *([] if course.truth is None else [f"{row['bad_1']:26.2f}"]),
            f" {', '.join(told)}"]).rstrip())
    if course.config.algorithm == 'realtime' and not course.frames and not any(
            any(row.get('gains', {}).values()) for row in course.rows):
        lines.append('nothing evolved: no plane of a plain region is fitter; two folders of '
                     'frames show what evolves from frame to frame')
    return lines
