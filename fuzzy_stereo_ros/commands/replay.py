# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""`fuzzy-stereo replay`: match bags or frames; write a bag of disparities, files or a video."""
from contextlib import ExitStack
from dataclasses import replace
import sys

from fuzzy_stereo_ros.bags.reading import BagReader
from fuzzy_stereo_ros.bags.writing import CopiedMessages, FORMATS
from fuzzy_stereo_ros.commands.shared_options import as_json
from fuzzy_stereo_ros.matching import StereoMatcher, WARM_UP_SIZE
from fuzzy_stereo_ros.matching.plausibility import PlausibilityCheck
from fuzzy_stereo_ros.matching.search_range import PAIRS, search_range
from fuzzy_stereo_ros.pairs.calibration import points_reach, reach
from fuzzy_stereo_ros.pairs.result_messages import topics_of
from fuzzy_stereo_ros.parameters.options import (
    add_camera_options, add_matcher_options, add_node_options, is_automatic, matcher_config,
    node_rows, option_values)
from fuzzy_stereo_ros.replay.loop import interruption, match_in_order, replay, Stats
from fuzzy_stereo_ros.replay.options import (
    NO_BAG, OPTIONAL_RESULTS, READING, ReplayOptions, RESULTS, SEGMENT_PAIRS, SYNCHRONISING,
    USUAL_RESULTS, WARM_PAIRS)
from fuzzy_stereo_ros.replay.report import (
    end_sentence, figures_of, no_pair_sentence, ProgressBar, sentences)
from fuzzy_stereo_ros.replay.segments import match_in_segments, opened_cluster
from fuzzy_stereo_ros.replay.sinks import Outputs
from fuzzy_stereo_ros.replay.source import first_pairs, opened_recording, ReplaySource
from fuzzy_stereo_ros.views.video import CODECS

MAP_SUFFIXES = 'npy', 'pfm', 'png'

ON_INTERRUPT = ''     # said with what was matched
HELP = 'match the pairs of a bag, of folders of images, or of a video'
DESCRIPTION = (
    'Match every pair of a recording as the node does. Write a bag of disparities with a\n'
    'coloured preview, files or a video. A recording is\n\n'
    '  bags           ROS 1 .bag; ROS 2 .mcap, .db3 or a folder. The topics of the cameras are\n'
    '                 found by type and name (left and right, infra1 and infra2, cam0 and cam1),\n'
    '                 their camera_info in the same namespace\n'
    '  frames         two folders, or two patterns in quotes; or one folder with left and right\n'
    '                 in it (as synthesise writes, EuRoC and KITTI), or with left_0.png and\n'
    '                 right_0.png, whose calib.txt is read\n'
    '  videos         two, or one with both images side by side')
EXAMPLE = ('examples:\n'
           '  fuzzy-stereo replay recorded.mcap --output matched --disparities 128\n'
           '  fuzzy-stereo replay recorded.bag --output matched --disparities 64 --rectify \\\n'
           '      --with depth points2 --keep /tf /tf_static\n'
           '  fuzzy-stereo replay left_folder right_folder --output matched\n'
           "  fuzzy-stereo replay 'left/*.png' 'right/*.png' --rate 30 --format none \\\n"
           '      --video matched.mp4\n'
           '  fuzzy-stereo replay recorded --format none --video matched.mp4 --disparities 64\n'
           '  fuzzy-stereo replay recorded --output matched --disparities 64 --workers 4')


def add_arguments(parser):
    parser.add_argument('bags', metavar='BAG', nargs='+',
                        help='bags; several are read as one, in the order of their time. Or '
                             'folders, patterns or videos of the left and of the right camera')
    parser.add_argument('--rate', metavar='NUMBER', type=float,
                        help='frames per second of folders and videos; default: the times in '
                             'the names of files, or 10; the rate of the video')
    parser.add_argument('--output', metavar='DIR',
                        help='new folder for the results, a ROS 2 bag; required except with '
                             f'--format {NO_BAG} and without --files')
    parser.add_argument('--format', dest='storage', choices=(*FORMATS, NO_BAG),
                        default=FORMATS[0],
                        help=f'storage of the bag; {NO_BAG}: no bag, only --files and --video; '
                             f'default: {FORMATS[0]}')
    parser.add_argument('--with', dest='results', choices=OPTIONAL_RESULTS, nargs='+', default=[],
                        help=f"topics to write besides {' and '.join(USUAL_RESULTS)}: "
                             f"{', '.join(OPTIONAL_RESULTS)}")
    parser.add_argument('--keep', metavar='TOPIC', nargs='*',
                        help='topics to copy into the bag; without a name all topics')
    parser.add_argument('--files', choices=MAP_SUFFIXES, nargs='+', default=[],
                        help='also write a disparity file for each pair, DIR/disparity/STAMP in '
                             'ns (STAMP_1 of a second pair with it): npy (invalid: NaN), pfm '
                             '(inf) or png (16 bits as KITTI, 0); DIR/calibration.json has what '
                             'turns disparities into metres')
    parser.add_argument('--overwrite', action='store_true',
                        help='replace what an earlier replay wrote to DIR, and the file of '
                             '--video')
    parser.add_argument('--resume', action='store_true',
                        help='continue after the last pair that an interrupted replay wrote to '
                             'DIR, with the same options; a few earlier pairs are matched again '
                             'to warm up, so that results may differ a little from an '
                             'uninterrupted replay; with workers they are equal')
    parser.add_argument('--json', action='store_true', help='print the figures as JSON')
    part = parser.add_argument_group('which pairs')
    part.add_argument('--start', metavar='SECONDS', type=float,
                      help='time to skip at the beginning of the bag')
    part.add_argument('--duration', metavar='SECONDS', type=float,
                      help='time to match; default: to the end of the bag')
    part.add_argument('--every', metavar='N', type=int, default=1,
                      help='match only each N-th pair; default: 1')
    cameras = parser.add_argument_group('which cameras')
    cameras.add_argument('--left', metavar='TOPIC', help='images of the left camera')
    cameras.add_argument('--right', metavar='TOPIC', help='images of the right camera')
    parser.add_argument('--video', metavar='FILE',
                        help=f"{' or '.join(CODECS)}: image, disparity and confidence side by "
                             'side, a frame for each pair, as fast as they were recorded')
    add_camera_options(parser)
    add_node_options(parser, 'how messages become pairs', (*SYNCHRONISING, *READING))
    add_node_options(parser, 'depth and points2', RESULTS)
    workers = parser.add_argument_group(
        'in parallel',
        f'both cut the bag into segments of {SEGMENT_PAIRS} pairs, each warmed up on the '
        f'{WARM_PAIRS} pairs before it: results are the same for every number of workers, and '
        'may differ a little from those without workers, where each pair follows the previous '
        'one as in the node')
    workers.add_argument('--workers', metavar='N', type=int,
                         help='number of processes on this machine, of one thread each unless '
                              '--threads is given')
    workers.add_argument('--scheduler', metavar='ADDRESS',
                         help='of a Dask cluster, such as tcp://host:8786, whose workers match; '
                              'they need the same version of fuzzy_stereo_ros, but not the bag')
    add_matcher_options(parser, left_out=('reference',), automatic=True)


def run(arguments, stream, progress_stream=None):
    """Replay bags and print the report; errors come after all results so far are written."""
    automatic = is_automatic(arguments)
    options = ReplayOptions.of(
        arguments, config=matcher_config(arguments),
        settings=option_values(arguments, node_rows((*SYNCHRONISING, *READING, *RESULTS))))
    with ExitStack() as opened:
        bags, options = opened_recording(options, opened)
        if automatic:
            scale = options.settings['scale']
            first, count = (round(pixels / scale) for pixels in search_range(
                [(pair.left, pair.right) for pair in first_pairs(options, bags, PAIRS)]))
            options = replace(options, config=replace(
                options.config, min_disparity=first, disparities=count))
        source, copies = ReplaySource(options, bags), None
        if options.keep is not None:    # a reader of its own, for the thread that writes
            copies = CopiedMessages(
                opened.enter_context(BagReader(options.bags)), options.keep,
                {f'/{topic}' for topic in topics_of(options.bag_results)}, source.start,
                source.stop)
        outputs = Outputs(options, source, copies)
        if not arguments.json:
            stream.write(f'{source.cameras}, calibrated by {source.calibration}\n')
            stream.flush()
        with ProgressBar(source.expected_pairs(), progress_stream) as bar:
            for loss in bags.losses:
                bar.log(loss)
            stats = _match_all(options, source, outputs, bar)
        # Nothing may be left to match.
        if not (stats.matched or stats.interrupted or (
                outputs.continued and source.caught_up and stats.error is None)):
            raise ValueError(no_pair_sentence(bags.names, options, outputs, source, stats))
        figures = {'output': options.output, 'video': options.video,
                   'topics': source.topics._asdict(), 'calibration': source.calibration,
                   'losses': bags.losses, 'points_reach': points_reach(
                       stats.calibration.points_limit(options.settings['points_max_depth'])
                   ) if stats.calibration and 'points2' in options.results else '',
                   'reach': stats.calibration and reach(
                       options.config.min_disparity, options.config.disparities,
                       stats.calibration.scaled(1 / options.settings['scale'])),
                   **figures_of(stats, source.synchroniser, bags.begin)}
        where = ', '.join(filter(None, (options.output, options.video)))
        stream.write((as_json(figures) if arguments.json else
                      f"{where}: {sentences(figures, options.settings['approximate_sync'])}")
                     + '\n')
        if stats.error is not None:
            raise ValueError(end_sentence(stats, outputs, options, bags.begin))
        if stats.interrupted:
            (progress_stream or sys.stderr).write(
                end_sentence(stats, outputs, options, bags.begin) + '\n')
            raise KeyboardInterrupt


def _match_all(options, source, outputs, bar):
    """Match the pairs of a ReplaySource, here or on workers, write them, and return the Stats."""
    stats = Stats(plausibility=PlausibilityCheck(scale=options.settings['scale']))
    stats.plausibility.warm_up()
    if source.topics.raw_by_name and not options.settings['rectify']:
        stats.note(f'{source.topics.left} and {source.topics.right} are matched without '
                   'rectification; give --rectify if they are raw images', bar.log)
    with ExitStack() as opened:
        if options.in_segments:
            cluster = opened.enter_context(opened_cluster(options, bar.log))
        matcher = StereoMatcher(options.scaled_config)
        if options.scheduler is None:       # else other machines keep the kernels
            matcher.warm_up(*WARM_UP_SIZE)
        if options.in_segments:
            cluster.warm_up()
        stopped = opened.enter_context(interruption())
        items = source.items(outputs.written_positions())
        results = (match_in_segments(items, cluster, stats, stopped) if options.in_segments
                   else match_in_order(items, matcher))
        replay(results, outputs, stats, stopped, bar.log, bar.step)
    return stats
