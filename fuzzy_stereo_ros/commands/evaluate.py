# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""`fuzzy-stereo evaluate`: measure matchers side by side, with ground truth or without."""
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from itertools import islice
from pathlib import Path
import sys

from fuzzy_stereo_ros.commands.shared_options import as_json, checked_outputs, UNTOUCHED
from fuzzy_stereo_ros.evaluation.baselines import opencv_threads
from fuzzy_stereo_ros.evaluation.catalogue import FoundScenes, Scene, search
from fuzzy_stereo_ros.evaluation.ground_truth import MIDDLEBURY, PairWithoutTruth
from fuzzy_stereo_ros.evaluation.matchers import matcher_named, ResultFiles, USUAL
from fuzzy_stereo_ros.evaluation.measuring import COLUMNS, mean_records, measure, NoSequence
from fuzzy_stereo_ros.pairs.frames import are_pairs, Frames
from fuzzy_stereo_ros.pairs.image_files import check_suffix, read_image, read_pair, write_whole
from fuzzy_stereo_ros.pairs.pair_reader import PairReader
from fuzzy_stereo_ros.parameters.options import (
    add_camera_options, add_matcher_options, CameraOptions, matcher_changes)
from fuzzy_stereo_ros.progress import follow

REPEATS, FRAMES = 3, 20
# Truths are of the left image; maps are measured as they come and filled, cold and warm.
DECIDED = ('disparities', 'min_disparity', 'reference', 'fill', 'warm_start', 'threads')
REPORT_SUFFIXES = {'csv': '.csv', 'json': '.json', 'html': '.html'}
STDOUT = '-'

ON_INTERRUPT = UNTOUCHED
HELP = 'measure matchers on scenes with ground truth, or on own pairs'
DESCRIPTION = (
    'Measure matchers side by side on scenes with ground truth, and print tables as Markdown.\n\n'
    'DIR is a scene or holds scenes at any depth: Middlebury v2, 2005, 2006, 2014 and later,\n'
    'KITTI 2012 and 2015 in their official structure, left.png and right.png with a\n'
    'groundtruth.png, .pfm, .npy or .npz, and numbered frames (left_07.png, right_07.png or\n'
    'left/0007.png, right/0007.png), which are also matched as a sequence, warm and cold.\n\n'
    'Without ground truth: the same scenes, or frames as for replay, whose maps are compared by\n'
    'density, agreement of both images, flicker and time.\n\n'
    "matchers: ours, or ours:PROFILE; opencv:bm, :sgbm, :3way or :hh4 at stereo_image_proc's\n"
    'defaults, or tuned: opencv:bm:tuned.')
EXAMPLE = ('examples:\n'
           '  fuzzy-stereo evaluate MiddEval3/trainingQ --html evaluation.html\n'
           '  fuzzy-stereo evaluate kitti2015/training --matcher ours opencv:sgbm \\\n'
           '      --results other=results/disp_0 --csv figures.csv\n'
           '  fuzzy-stereo evaluate left_folder right_folder --html evaluation.html')


def add_arguments(parser):
    parser.add_argument('folders', metavar='DIR', nargs='+',
                        help='a scene, or a folder of scenes; or two folders, patterns or videos '
                             'without ground truth')
    parser.add_argument('--matcher', metavar='NAME', nargs='*', default=list(USUAL),
                        help=f'matchers to measure; default: {" ".join(USUAL)}')
    parser.add_argument('--results', metavar='[NAME=]DIR', action='append', default=[],
                        help='a folder with the disparities of another program, named like the '
                             'scenes: .pfm, .npy, .npz or .png (16 bits as KITTI); repeat it for '
                             'more programs')
    parser.add_argument('--only', metavar='WORD', default='',
                        help='only scenes whose name contains this word')
    parser.add_argument('--disparities', metavar='N', type=int, dest='searched',
                        help='number of disparities to search from 0; default: that of calib.txt, '
                             'of the known scene, or what the truth needs')
    parser.add_argument('--truth-scale', metavar='NUMBER', type=float,
                        help='grey levels per pixel of disparity in truths of 8 bits whose scale '
                             'is not known')
    parser.add_argument('--repeats', metavar='N', type=int, default=REPEATS,
                        help=f'runs, of which the fastest counts; default: {REPEATS}')
    parser.add_argument('--threads', metavar='N', type=int, default=1,
                        help='threads of each matcher, ours and those of OpenCV; default: 1')
    written = parser.add_argument_group('outputs')
    written.add_argument('--csv', metavar='FILE.csv',
                         help='a row for each scene, matcher, mask and kind of map')
    written.add_argument('--json', metavar='FILE.json', nargs='?', const=STDOUT,
                         help='the same as JSON; without FILE it is printed instead of the tables')
    written.add_argument('--html', metavar='FILE.html',
                         help='a page with tables and pictures, in one file')
    written.add_argument('--overwrite', action='store_true', help='replace files that exist')
    own = parser.add_argument_group('pairs without ground truth')
    own.add_argument('--frames', metavar='N', type=int, default=FRAMES,
                     help=f'number of frames that are matched; default: {FRAMES}')
    own.add_argument('--rectify', action='store_true',
                     help='the images are raw: rectify them by --calibration')
    add_camera_options(parser)
    add_matcher_options(parser, left_out=DECIDED)


@contextmanager
def libraries_needed():
    """Raise ValueError if a library that the block imports is not installed."""
    try:
        yield
    except ModuleNotFoundError as error:
        raise ValueError(f"{error.name} is not installed: pip install '.[evaluate]' in the folder "
                         'of the package') from None


def run(arguments, stream, progress_stream=None):
    """Measure the matchers, write the files, and print tables or JSON."""
    outputs = checked_outputs(arguments, {
        name: partial(check_suffix, allowed=[suffix]) for name, suffix in REPORT_SUFFIXES.items()
        if getattr(arguments, name) != STDOUT})
    with libraries_needed():
        from fuzzy_stereo_ros.evaluation.page import Gallery, page_of
        from fuzzy_stereo_ros.evaluation.report import markdown
        from fuzzy_stereo_ros.evaluation.summary import report_of
        import pandas as pd
        if 'html' in outputs:
            import jinja2   # noqa: F401  for the page
    for name, value in (
            ('repeats', arguments.repeats), ('threads', arguments.threads),
            ('disparities', arguments.searched), ('frames', arguments.frames)):
        if value is not None and value < 1:
            raise ValueError(f'--{name} is {value}; allowed are 1 and more')
    if arguments.truth_scale is not None and not 0 < arguments.truth_scale < float('inf'):
        raise ValueError(f'--truth-scale is {arguments.truth_scale}; allowed are numbers above 0')
    matchers = [matcher_named(name, arguments.profile, matcher_changes(arguments))
                for name in dict.fromkeys(arguments.matcher)]
    try:
        found = search([Path(folder) for folder in arguments.folders], arguments.truth_scale,
                       arguments.only)
    except ValueError as error:
        if arguments.results:
            raise
        found = _own_pairs(arguments, error)
    matchers += _result_files(arguments.results, found, [each.name for each in matchers])
    if not matchers:
        raise ValueError('no matcher is named: give --matcher NAME or --results DIR')
    gallery = Gallery(matchers[0].name)
    results, sequences, skipped = _measure_all(
        arguments, found, matchers, gallery.show if 'html' in outputs else None,
        partial(follow, stream=progress_stream or sys.stderr))
    means = mean_records(results, matchers)
    report = report_of(results, sequences, means, matchers, {
        'threads': f'{arguments.threads} each',
        'time': f'the fastest of {arguments.repeats}, from two images to a map as it comes, '
                'without filling; on scenes cold; of OpenCV compute() alone, on grey images, '
                'tuned ones with the padded columns that give it the left border'}, skipped)
    records = [record for one in (*results, *sequences) for record in one.records] + means
    in_json = as_json({
        'settings': report.settings, 'left_out': report.skipped, 'records': records})
    written = {'json': lambda: in_json + '\n',
               'csv': lambda: pd.DataFrame(records, columns=COLUMNS, dtype=object).to_csv(
                   index=False, lineterminator='\n'),
               'html': lambda: page_of(report, [gallery.shown[name] for name in gallery.ranked()],
                                       gallery.order())}
    for name, path in outputs.items():
        write_whole(path, written[name]().encode())
    stream.write(in_json + '\n' if arguments.json == STDOUT else markdown(report))


def _own_pairs(arguments, error):
    """Return `FoundScenes` of pairs without ground truth; error: raised if there are no images."""
    cameras, reader = CameraOptions.of(arguments), PairReader(arguments.rectify)

    def pair_of(read, paths):
        """Return the PairWithoutTruth of two images of files or a video; read(): returns them."""
        def rectified():
            images, infos = read(), (None, None)
            if arguments.rectify or cameras.given:
                infos, _ = cameras.cameras(images[0].shape[:2], 'depth', arguments.rectify, paths)
            return reader.read_images(images, infos)
        return PairWithoutTruth(rectified)

    if are_pairs(arguments.folders) and not arguments.only:
        frames = Frames(arguments.folders)
        files = {f'pair {number}': pair_of(
            lambda pair=pair: tuple(one.read() for one in pair), frames.paths)
            for number, (_, *pair) in enumerate(islice(frames.pairs(), arguments.frames))}
        return FoundScenes([], [Scene('', frames.name, MIDDLEBURY, None, None, files=files)], [])
    try:
        found = search([Path(folder) for folder in arguments.folders], None, arguments.only,
                       with_truth=False)
    except ValueError:
        raise error from None
    paths = [(scene, scene.files[''].left, scene.files[''].right) for scene in found.scenes]
    return found._replace(scenes=[replace(scene, files={
        '': pair_of(partial(read_pair, *both), both)}) for scene, *both in paths])


def _measure_all(arguments, found, matchers, show, progress):
    options, skipped, sequences = (arguments.searched, arguments.repeats), [*found.skipped], []
    with opencv_threads(arguments.threads):
        results = [measure(scene, matchers, *options, show)
                   for scene in progress(found.scenes, 'scenes')]
        for sequence in progress(found.sequences, 'sequences'):
            try:
                sequences.append(measure(sequence, matchers, *options, show))
            except NoSequence as error:
                skipped.append(str(error))
    if not results and not sequences:
        raise ValueError(skipped[-1])
    return results, sequences, skipped


def _result_files(words, found, taken):
    """Return the `ResultFiles` of --results; reads each file once to check it."""
    named = {name: files for subject in (*found.scenes, *found.sequences)
             for name, files in subject.named_files.items()}
    matchers = []
    for word in words:
        alone = Path(word).is_dir() or '=' not in word      # a folder's name may contain `=`
        label, folder = ('', word) if alone else word.split('=', 1)
        label = label or Path(folder).resolve().name
        if label in taken:
            raise ValueError(f"two matchers have the name '{label}'; give one of them another: "
                             '--results NAME=DIR')
        taken = [*taken, label]
        matcher = ResultFiles(label, folder, list(named))
        for name, path in matcher.files.items():
            if path is not None:
                matcher.read(name, read_image(named[name].left))
        matchers.append(matcher)
    return matchers
