# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""`fuzzy-stereo replay`: bags in, a bag of disparities or files out."""
from contextlib import ExitStack
import json
import sys

from fuzzy_stereo_ros.bags.reading import BagReader, DamagedBag, text_of
from fuzzy_stereo_ros.bags.writing import FORMATS
from fuzzy_stereo_ros.pair_matcher import Rig
from fuzzy_stereo_ros.parameters.camera_options import add_camera_options
from fuzzy_stereo_ros.parameters.matcher_options import add_matcher_options
from fuzzy_stereo_ros.parameters.node_options import add_node_options
from fuzzy_stereo_ros.replay.cluster_options import add_cluster_options, opened_cluster
from fuzzy_stereo_ros.replay.interruption import Interruption
from fuzzy_stereo_ros.replay.loop import Outputs, replay, Tally
from fuzzy_stereo_ros.replay.plan import (
    ALWAYS, asked_for, BY_CHOICE, check_outputs, is_lasting, NO_BAG, planned, READING, RESULTS,
    SYNCHRONISING)
from fuzzy_stereo_ros.replay.report import figures_of, no_pair_sentence, sentences, Shown
from fuzzy_stereo_ros.replay.request import expected_pairs, SECOND
from fuzzy_stereo_ros.replay.segments import SegmentedReplay
from fuzzy_stereo_ros.replay.sinks import BagSink, FileSink, MARK, remarks_on_files
from fuzzy_stereo_ros.replay.views import add_view_options, names_of_views, views_of

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
    asked = asked_for(arguments)
    check_outputs(arguments, asked)
    with BagReader(arguments.bags) as bags:
        plan = planned(arguments, asked, bags)
        if not arguments.json:
            stream.write(
                f'{plan.topics.left} and {plan.topics.right}, calibrated by {plan.calibration}\n')
            stream.flush()
        outputs, tally, source = _replayed(arguments, bags, plan, progress_stream)
        if not tally.matched:
            _end_without_pairs(bags, plan.folder, source, tally, plan.settings)
        figures = {'output': arguments.output, 'video': arguments.video, 'view': arguments.view,
                   'topics': plan.topics._asdict(), 'calibration': plan.calibration,
                   **figures_of(tally, source.synchroniser, bags.begin)}
        where = ', '.join(filter(None, (arguments.output, *names_of_views(arguments))))
        told = sentences(figures, plan.settings['approximate_sync'])
        stream.write((json.dumps(figures, indent=2) if arguments.json
                      else f'{where}: {told}') + '\n')
        _end(bags, arguments, outputs, tally, progress_stream or sys.stderr)


def _replayed(arguments, bags, plan, progress_stream):
    """Match what a ReplayPlan says; return the Outputs, the Tally and what the steps came from."""
    rig = Rig(plan.config, plan.reader, told=None)
    views = views_of(arguments, plan.config_at_scale, plan.source(bags, lambda messages: None))
    outputs, tally = Outputs(lambda: plan.opened_sinks() + views), Tally()
    with ExitStack() as opened:
        shown = opened.enter_context(Shown(
            expected_pairs(bags, plan.topics, plan.selection), progress_stream,
            arguments.progress))
        for remark in plan.remarks:
            tally.note(remark, shown.tell)
        cluster = opened.enter_context(
            opened_cluster(arguments, plan.config_at_scale, shown.tell))
        (cluster or rig).warm_up()
        stopped = opened.enter_context(Interruption()).came
        if cluster is None:
            source = plan.source(bags, rig.read, plan.copies.topics)
        else:
            # The pairs are read ahead of what is copied between them: by a reader of their own.
            ahead = plan.source(opened.enter_context(BagReader(arguments.bags)), rig.read)
            source = rig = SegmentedReplay(
                ahead, cluster, tally, stopped, bags.messages(
                    plan.copies.topics, plan.selection.start, plan.selection.stop))
        replay(source, rig, outputs, tally, stopped, shown.tell, shown.step)
        for remark in remarks_on_files(
                [sink for sink in outputs.sinks or () if isinstance(sink, FileSink)]):
            tally.note(remark, shown.tell)
    return outputs, tally, source


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
    lasting, pairs, logged = is_lasting(arguments), outputs.written, outputs.logged
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
