# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""`fuzzy-stereo replay`: bags in, a bag of disparities or files out."""
from contextlib import ExitStack
import json
import sys

from fuzzy_stereo_ros.bags.copying import CopiedMessages
from fuzzy_stereo_ros.bags.reading import BagReader
from fuzzy_stereo_ros.bags.writing import FORMATS
from fuzzy_stereo_ros.matching import StereoMatcher, WARM_UP_SIZE
from fuzzy_stereo_ros.matching.compiling import warm_up
from fuzzy_stereo_ros.parameters.options import (
    add_camera_options, add_matcher_options, add_node_options, CAMERA, matcher_changes,
    node_settings)
from fuzzy_stereo_ros.parameters.table import profile_config
from fuzzy_stereo_ros.replay.loop import interruption, match_in_order, replay, Stats
from fuzzy_stereo_ros.replay.options import (
    ALWAYS, BY_CHOICE, NO_BAG, READING, ReplayOptions, RESULTS, SEGMENT_PAIRS, SYNCHRONISING,
    VIEWER, WARM_PAIRS)
from fuzzy_stereo_ros.replay.report import (
    end_sentence, figures_of, no_pair_sentence, ProgressBar, sentences)
from fuzzy_stereo_ros.replay.segments import match_in_segments, opened_cluster
from fuzzy_stereo_ros.replay.sinks import Outputs
from fuzzy_stereo_ros.replay.source import ReplaySource
from fuzzy_stereo_ros.views.video import CODECS

SUFFIXES = 'npy', 'pfm', 'png'

HELP = 'match the pairs of a bag'
DESCRIPTION = (
    'Match every pair of one or more bags (ROS 1 .bag; ROS 2 .mcap, .db3 or a folder) as the\n'
    'node does, and write a bag of disparities with a preview in colours, files, a video, or\n'
    'show them.\n'
    'The topics of the cameras are found by type and name (left and right, infra1 and infra2,\n'
    'cam0 and cam1), their camera_info in the same namespace.')
EXAMPLE = ('examples:\n'
           '  fuzzy-stereo replay recorded.mcap --output matched --disparities 128\n'
           '  fuzzy-stereo replay recorded.bag --output matched --disparities 64 --rectify \\\n'
           '      --with depth points2 --keep /tf /tf_static\n'
           '  fuzzy-stereo replay recorded --format none --video matched.mp4 --disparities 64\n'
           '  fuzzy-stereo replay recorded --output matched --disparities 64 --workers 4')


def add_arguments(parser):
    """Add the arguments of `replay`."""
    parser.add_argument('bags', metavar='BAG', nargs='+',
                        help='bags; several are read as one, in the order of time')
    parser.add_argument('--output', metavar='DIR',
                        help='folder that is made for the results: a bag of ROS 2; needed but '
                             f'with --format {NO_BAG} and without --files')
    parser.add_argument('--format', dest='storage', choices=(*FORMATS, NO_BAG),
                        default=FORMATS[0],
                        help=f'of the bag; {NO_BAG}: no bag, only what is asked for otherwise; '
                             f'default: {FORMATS[0]}')
    parser.add_argument('--with', dest='results', choices=BY_CHOICE, nargs='+', default=[],
                        help=f"topics to be written besides {' and '.join(ALWAYS)}: "
                             f"{', '.join(BY_CHOICE)}")
    parser.add_argument('--keep', metavar='TOPIC', nargs='*',
                        help='topics to be copied into the bag; without a name all of them')
    parser.add_argument('--files', choices=SUFFIXES, nargs='+', default=[],
                        help='also a file of disparities for each pair, in DIR/disparity, named '
                             'by its stamp in ns (of several with one stamp the last): npy '
                             '(invalid: NaN), pfm (inf) or png (16 bits as KITTI, 0); '
                             'DIR/calibration.json makes metres of them')
    parser.add_argument('--overwrite', action='store_true',
                        help='replace what an earlier replay wrote to DIR, and the files of '
                             '--video and --view')
    parser.add_argument('--resume', action='store_true',
                        help='go on after the last pair that an interrupted replay wrote to DIR, '
                             'with the same options; a few pairs before it are matched again to '
                             'warm up, so that later ones may differ a little from those of a '
                             'replay in one go; with workers nothing differs')
    parser.add_argument('--progress', action='store_true',
                        help='show a bar even where standard error is no terminal')
    parser.add_argument('--json', action='store_true', help='print the figures as JSON')
    part = parser.add_argument_group('which pairs')
    part.add_argument('--start', metavar='SECONDS', type=float,
                      help='leave out what was recorded earlier, from the begin of the bag')
    part.add_argument('--duration', metavar='SECONDS', type=float, help='match only so much')
    part.add_argument('--every', metavar='N', type=int, default=1,
                      help='match the first of so many pairs')
    cameras = parser.add_argument_group('which cameras')
    cameras.add_argument('--left', metavar='TOPIC', help='images of the left camera')
    cameras.add_argument('--right', metavar='TOPIC', help='images of the right camera')
    views = parser.add_argument_group('what can be looked at')
    views.add_argument('--video', metavar='FILE',
                       help=f"{' or '.join(CODECS)}: image, disparity and confidence beside each "
                            'other, a frame for each pair')
    views.add_argument('--video-rate', metavar='NUMBER', type=float,
                       help='frames per second; default: as the stamps of the first pairs, so '
                            'that it lasts as long as what was recorded')
    views.add_argument('--view', metavar='FILE.rrd', nargs='?', const=VIEWER,
                       help='show image, disparity, confidence and points in the Rerun viewer, '
                            'or write a file for it; needs rerun-sdk')
    add_camera_options(parser)
    add_node_options(parser, 'how messages become pairs', (*SYNCHRONISING, *READING))
    add_node_options(parser, 'what depth and points2 are like', RESULTS)
    workers = parser.add_argument_group(
        'many at a time',
        f'either cuts the bag into segments of {SEGMENT_PAIRS} pairs, each warmed over the '
        f'{WARM_PAIRS} pairs before it: the result is the same for every number of workers, and '
        'may differ a little from that without workers, which is one chain as in the node')
    workers.add_argument('--workers', metavar='N', type=int,
                         help='match in so many processes of this machine, of one thread each '
                              'unless --threads says otherwise')
    workers.add_argument('--scheduler', metavar='ADDRESS',
                         help='match on the workers of a Dask cluster, as tcp://host:8786; they '
                              'need fuzzy_stereo_ros of the same version, but not the bag')
    add_matcher_options(parser, required=('disparities',), left_out=('reference',))


def replay_options(arguments):
    """Return the ReplayOptions of parsed arguments; ValueError where they make no sense."""
    alike = ('output', 'storage', 'video', 'video_rate', 'view', 'overwrite', 'resume', 'left',
             'right', 'start', 'duration', 'every', 'workers', 'scheduler')
    lists = 'bags', 'results', 'keep', 'files'
    return ReplayOptions(
        config=profile_config(arguments.profile, **matcher_changes(arguments)),
        settings=node_settings(arguments, (*SYNCHRONISING, *READING, *RESULTS)),
        **{name: getattr(arguments, name) for name in (*alike, *CAMERA)},
        **{name: getattr(arguments, name) and tuple(getattr(arguments, name)) for name in lists})


def run(arguments, stream, progress_stream=None):
    """
    Replay bags and print how it went.

    stream, progress_stream: texts; standard error if None.
    Raises ValueError and OSError for bad input, before anything is written, and for a damaged bag
    or a full disk after everything so far is; KeyboardInterrupt likewise.
    """
    options = replay_options(arguments)
    with ExitStack() as opened:
        bags = opened.enter_context(BagReader(options.bags))
        source, copies = ReplaySource(options, bags), None
        if options.keep is not None:    # which are read by the thread that writes
            copies = CopiedMessages(opened.enter_context(BagReader(options.bags)), options.keep,
                                    options.result_topics, source.start, source.stop)
        outputs = Outputs(options, source, copies)
        if not arguments.json:
            stream.write(f'{source.topics.left} and {source.topics.right}, calibrated by '
                         f'{source.calibration}\n')
            stream.flush()
        with ProgressBar(source.expected_pairs(), progress_stream, arguments.progress) as bar:
            stats = _replayed(options, source, outputs, bar)
        if not stats.matched:
            _end_without_pairs(bags.names, options, outputs, source, stats)
        figures = {'output': options.output, 'video': options.video, 'view': options.view,
                   'topics': source.topics._asdict(), 'calibration': source.calibration,
                   **figures_of(stats, source.synchroniser, bags.begin)}
        where = ', '.join(filter(None, (options.output, *options.views)))
        stream.write((json.dumps(figures, indent=2) if arguments.json else
                      f"{where}: {sentences(figures, options.settings['approximate_sync'])}")
                     + '\n')
        if stats.error is not None:
            raise ValueError(end_sentence(stats, outputs, options, bags.begin))
        if stats.interrupted:
            (progress_stream or sys.stderr).write(
                end_sentence(stats, outputs, options, bags.begin) + '\n')
            raise KeyboardInterrupt


def _replayed(options, source, outputs, bar):
    """Match the pairs of a ReplaySource, here or on workers, and return the Stats."""
    stats = Stats()
    stats.epipolar.warm_up()
    if source.topics.raw_by_name and not options.settings['rectify']:
        stats.note(f'{source.topics.left} and {source.topics.right} are matched as they come: '
                   'give --rectify unless they are rectified', bar.log)
    with ExitStack() as opened:
        if options.in_segments:
            cluster = opened.enter_context(opened_cluster(options, bar.log))
            cluster.warm_up()
        else:
            matcher = StereoMatcher(options.scaled_config)
            warm_up(matcher, *WARM_UP_SIZE)
        stopped = opened.enter_context(interruption())
        steps = source.steps(outputs.stamps_before())
        results = (match_in_segments(steps, cluster, stats, stopped) if options.in_segments
                   else match_in_order(steps, matcher))
        replay(results, outputs, stats, stopped, bar.log, bar.step)
    return stats


def _end_without_pairs(name, options, outputs, source, stats):
    """Say why no new pair was matched; return where that is no fault."""
    if stats.interrupted or (outputs.continued and source.resumed and stats.error is None):
        return
    if stats.error is not None:
        raise ValueError(f"{stats.error}; no {'new ' if outputs.continued else ''}pair could be "
                         'matched before that')
    if outputs.continued:
        raise ValueError(f'--resume: the last pairs in {outputs.path} are not in {name}')
    raise ValueError(no_pair_sentence(
        name, stats, source.synchroniser, options.settings['approximate_sync']))
