# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""`fuzzy-stereo replay`: bags in, a bag of disparities or files out."""
from contextlib import ExitStack
from dataclasses import asdict, replace
import json
from pathlib import Path
import sys

from fuzzy_stereo_ros.camera_options import add_camera_options
from fuzzy_stereo_ros.cluster_options import (
    add_cluster_options, asks_for_cluster, opened_cluster)
from fuzzy_stereo_ros.interruption import Interruption
from fuzzy_stereo_ros.matcher_options import add_matcher_options, matcher_changes
from fuzzy_stereo_ros.node_options import add_node_options, node_settings
from fuzzy_stereo_ros.pairs.bag_reading import BagReader, DamagedBag, text_of
from fuzzy_stereo_ros.pairs.bag_writing import FORMATS
from fuzzy_stereo_ros.pairs.pair_reader import PairReader
from fuzzy_stereo_ros.parameter_table import OUTPUTS, profile_config, sync_tolerance
from fuzzy_stereo_ros.replay import Outputs, replay, Tally
from fuzzy_stereo_ros.replay_folder import ReplayFolder
from fuzzy_stereo_ros.replay_report import figures_of, no_pair_sentence, sentences, Shown
from fuzzy_stereo_ros.replay_request import (
    chosen_calibration, chosen_copies, chosen_part, chosen_topics, done_before, expected_pairs,
    SECOND, WARM_PAIRS)
from fuzzy_stereo_ros.replay_segments import SEGMENT_PAIRS, SegmentedReplay
from fuzzy_stereo_ros.replay_sinks import BagSink, FileSink, MARK
from fuzzy_stereo_ros.replay_source import ReplaySource
from fuzzy_stereo_ros.replay_views import (
    add_view_options, check_views, names_of_views, views_of)
from fuzzy_stereo_ros.rig import Rig

ALWAYS = 'disparity', 'preview'
BY_CHOICE = tuple(word for word in OUTPUTS if word not in ALWAYS)
SUFFIXES = 'npy', 'pfm', 'png'
NO_BAG = 'none'
SYNCHRONISING = ('queue_size', 'approximate_sync', 'approximate_sync_tolerance_seconds',
                 'cache_camera_info')
READING = 'rectify', 'crop', 'scale'
RESULTS = 'depth_encoding', 'use_color', 'avoid_point_cloud_padding'

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
    parser.add_argument('--format', choices=(*FORMATS, NO_BAG), default=FORMATS[0],
                        help=f'of the bag; {NO_BAG}: no bag, only what is asked for otherwise; '
                             f'default: {FORMATS[0]}')
    parser.add_argument('--with', dest='words', choices=BY_CHOICE, nargs='+', default=[],
                        help=f"topics to be written besides {' and '.join(ALWAYS)}: "
                             f"{', '.join(BY_CHOICE)}")
    parser.add_argument('--keep', metavar='TOPIC', nargs='*',
                        help='topics to be copied into the bag; without a name all of them')
    parser.add_argument('--files', choices=SUFFIXES, nargs='+', default=[],
                        help='also a file of disparities for each pair, in DIR/disparity, named '
                             'by its stamp in ns: npy (invalid: NaN), pfm (inf) or png (16 bits '
                             'as KITTI, 0); DIR/calibration.json makes metres of them')
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
    add_view_options(parser)
    add_camera_options(parser)
    add_node_options(parser, 'how messages become pairs', (*SYNCHRONISING, *READING))
    add_node_options(parser, 'what depth and points2 are like', RESULTS)
    add_cluster_options(parser)
    add_matcher_options(parser, required=('disparities',), left_out=('reference',))


def run(arguments, stream, progress_stream=None):
    """
    Replay bags and print how it went.

    stream, progress_stream: texts; standard error if None.
    Raises ValueError and OSError for bad input, before anything is written, and for a damaged bag
    or a full disk after everything so far is; KeyboardInterrupt likewise.
    """
    config = profile_config(arguments.profile, **matcher_changes(arguments))
    settings = node_settings(arguments, (*SYNCHRONISING, *READING, *RESULTS))
    reader = PairReader(*(settings[name] for name in READING))
    _check_outputs(arguments, config.at_scale(reader.scale))
    segmented = asks_for_cluster(arguments)
    with BagReader(arguments.bags) as bags, ExitStack() as opened:
        words = (*ALWAYS, *arguments.words)
        topics = chosen_topics(bags, arguments.left, arguments.right, settings['rectify'])
        infos, calibration = chosen_calibration(
            bags, topics, arguments, settings['rectify'] or settings['crop'])
        selection = chosen_part(bags, arguments.start, arguments.duration, arguments.every)
        copies = chosen_copies(bags, arguments.keep, words)
        storage = None if arguments.format == NO_BAG else arguments.format
        folder = ReplayFolder(arguments.output, {
            'bags': [Path(bag).name for bag in arguments.bags], 'topics': topics._asdict(),
            'calibration': calibration, 'start': arguments.start,
            'duration': arguments.duration, 'every': arguments.every,
            'format': arguments.format, 'results': words, 'kept': sorted(copies.topics),
            'files': arguments.files, 'settings': settings,
            'segments': SEGMENT_PAIRS if segmented else None,
            'matcher': asdict(replace(config, threads=0))},     # they change no result
            arguments.bags, arguments.overwrite, arguments.resume)
        if folder.continued:
            selection = selection._replace(
                done=done_before(folder.path, storage, arguments.files,
                                 WARM_PAIRS + (SEGMENT_PAIRS if segmented else 0)))
        if not arguments.json:
            stream.write(f'{topics.left} and {topics.right}, calibrated by {calibration}\n')
            stream.flush()

        rig = Rig(config, reader, told=None)
        reading = settings, sync_tolerance(settings), selection
        # With workers the pairs are read ahead of what is copied between them.
        source = ReplaySource(
            opened.enter_context(BagReader(arguments.bags)) if segmented else bags, topics,
            rig.read, *reading, () if segmented else copies.topics, infos)
        views = views_of(
            arguments, config.at_scale(reader.scale),
            ReplaySource(bags, topics, lambda messages: None, *reading, infos=infos))

        def open_sinks():
            """Return the outputs that are asked for; a further kind takes a further line here."""
            folder.begin()
            sinks = [FileSink(folder.path, suffix) for suffix in arguments.files]
            if storage is not None:
                sinks.insert(0, BagSink(folder.path, storage, words, settings, copies))
            return sinks + views

        outputs, tally = Outputs(open_sinks), Tally()
        with Shown(expected_pairs(bags, topics, selection), progress_stream,
                   arguments.progress) as shown, \
                opened_cluster(arguments, config.at_scale(reader.scale), shown.tell) as cluster:
            (cluster or rig).warm_up()
            with Interruption() as interruption:
                stopped = interruption.came
                if cluster is not None:
                    source = rig = SegmentedReplay(
                        source, cluster, tally, stopped,
                        bags.messages(copies.topics, selection.start, selection.stop))
                replay(source, rig, outputs, tally, stopped, shown.tell, shown.step)
        if not tally.matched:
            _end_without_pairs(bags, folder, source, tally, settings)
        figures = {'output': arguments.output, 'video': arguments.video, 'view': arguments.view,
                   'topics': topics._asdict(), 'calibration': calibration,
                   **figures_of(tally, source.synchroniser, bags.begin)}
        where = ', '.join(filter(None, (arguments.output, *names_of_views(arguments))))
        stream.write((json.dumps(figures, indent=2) if arguments.json
                      else f'{where}: {sentences(figures)}') + '\n')
        _end(bags, arguments, outputs, tally, progress_stream or sys.stderr)


def _lasting(arguments):
    """Return whether a bag or files are written, which --resume can go on with."""
    return arguments.format != NO_BAG or bool(arguments.files)


def _check_outputs(arguments, config):
    """Raise ValueError where nothing would be written, or what a file cannot hold."""
    if not _lasting(arguments):
        if not names_of_views(arguments):
            raise ValueError(f'--format {NO_BAG} leaves nothing to be written; give --files, '
                             '--video or --view')
        if arguments.resume:
            raise ValueError('--resume goes on with a bag or with --files, and there is neither')
    elif arguments.output is None:
        raise ValueError('--output is missing; give a folder that is made for the results')
    check_views(arguments)
    if arguments.format == NO_BAG and arguments.keep is not None:
        raise ValueError(f'--keep copies into a bag, and --format {NO_BAG} writes none')
    if 'png' in arguments.files and (
            config.min_disparity < 0 or config.min_disparity + config.disparities > 256):
        raise ValueError('--files png holds 0 to 255 px; min_disparity and disparities ask for '
                         'others: give npy or pfm')


def _end_without_pairs(bags, folder, source, tally, settings):
    """Leave nothing where no new pair was matched, and say why; return where that is no fault."""
    folder.discard()
    if tally.interrupted or (folder.continued and source.resumed and tally.error is None):
        return
    if tally.error is not None:
        raise ValueError(f"{tally.error}; no {'new ' if folder.continued else ''}pair could be "
                         'matched before that')
    if folder.continued:
        raise ValueError(f'--resume: the last pairs in {folder.path} are not in {bags.names}')
    raise ValueError(no_pair_sentence(
        bags.names, tally, source.synchroniser, settings['approximate_sync']))


def _end(bags, arguments, outputs, tally, stream):
    """Say how far it came where it did not come to the end, by exception."""
    if tally.error is None and not tally.interrupted:
        return
    if outputs.sinks is None and tally.error is not None:
        raise ValueError(f'{arguments.output} cannot be made: {text_of(tally.error)}')
    lasting, pairs, logged = _lasting(arguments), outputs.written, outputs.logged
    where = arguments.output if lasting else ' and '.join(names_of_views(arguments))
    far = f'{pairs} pairs were written to {where}'
    for sink in outputs.sinks or ():
        if isinstance(sink, BagSink):
            pairs, logged = sink.bag.counts[MARK], sink.bag.last
            far = f'{where} holds {pairs} pairs'
    if pairs:
        far += f', up to {(logged - bags.begin) / SECOND:.3f} s into the bag'
    if tally.error is not None:
        # A video or recording that failed is not there.
        raise ValueError(text_of(tally.error) + (
            f'; {far}' if lasting or isinstance(tally.error, DamagedBag) else ''))
    stream.write(f"interrupted: {far}{'; --resume goes on' if lasting else ''}\n" if pairs else
                 'interrupted before the first pair\n')
    raise KeyboardInterrupt
