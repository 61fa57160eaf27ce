# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the options of a replay come to: what is read, how it is matched, where it goes."""
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, NamedTuple

from fuzzy_stereo_ros.bags.copying import Copies
from fuzzy_stereo_ros.bags.stereo_topics import are_raw_by_name, StereoTopics
from fuzzy_stereo_ros.matching import MatcherConfig
from fuzzy_stereo_ros.pairs.pair_reader import PairReader
from fuzzy_stereo_ros.parameters.matcher_options import matcher_changes
from fuzzy_stereo_ros.parameters.node_options import node_settings
from fuzzy_stereo_ros.parameters.table import OUTPUTS, profile_config, sync_tolerance
from fuzzy_stereo_ros.replay.cluster_options import asks_for_cluster
from fuzzy_stereo_ros.replay.folder import ReplayFolder
from fuzzy_stereo_ros.replay.request import (
    chosen_calibration, chosen_copies, chosen_part, chosen_topics, done_before, WARM_PAIRS)
from fuzzy_stereo_ros.replay.segments import SEGMENT_PAIRS
from fuzzy_stereo_ros.replay.sinks import BagSink, FileSink
from fuzzy_stereo_ros.replay.source import ReplaySource, Selection
from fuzzy_stereo_ros.replay.views import check_views, names_of_views

ALWAYS = 'disparity', 'preview'
BY_CHOICE = tuple(word for word in OUTPUTS if word not in ALWAYS)
NO_BAG = 'none'
SYNCHRONISING = ('queue_size', 'approximate_sync', 'approximate_sync_tolerance_seconds',
                 'cache_camera_info')
READING = 'rectify', 'crop', 'scale'
RESULTS = 'depth_encoding', 'use_color', 'avoid_point_cloud_padding'


class ReplayPlan(NamedTuple):
    """
    What is to be done with bags; nothing is written yet.

    config: MatcherConfig of the images as they are. settings: {node parameter: value}. reader:
    PairReader. topics: StereoTopics; copies: Copies of others. infos: as of a ReplaySource.
    calibration: a sentence, where they come from. selection: Selection. words: of the results.
    storage: of the bag, None where there is none. suffixes: of files. folder: ReplayFolder.
    """

    config: MatcherConfig
    settings: dict[str, Any]
    reader: PairReader
    topics: StereoTopics
    copies: Copies
    infos: Any
    calibration: str
    selection: Selection
    words: tuple[str, ...]
    storage: str | None
    suffixes: list[str]
    folder: ReplayFolder

    @property
    def config_at_scale(self):
        """The MatcherConfig of the images that are matched."""
        return self.config.at_scale(self.reader.scale)

    @property
    def remarks(self):
        """Sentences on what can be done but is hardly meant."""
        if self.settings['rectify'] or not are_raw_by_name(self.topics):
            return []
        return [f'{self.topics.left} and {self.topics.right} are matched as they come: give '
                '--rectify unless they are rectified']

    def source(self, bags, read, copied=()):
        """Return a ReplaySource of a BagReader; read, copied: as there."""
        return ReplaySource(bags, self.topics, read, self.settings,
                            sync_tolerance(self.settings), self.selection, copied, self.infos)

    def opened_sinks(self):
        """Begin to write; return the outputs that are kept, a line here for each kind."""
        self.folder.begin()
        sinks = [FileSink(self.folder.path, suffix) for suffix in self.suffixes]
        if self.storage is not None:
            # Last: --resume takes a pair for done that is in the bag.
            sinks.append(BagSink(self.folder.path, self.storage, self.words, self.settings,
                                 self.copies))
        return sinks


def planned(arguments, asked, bags):
    """
    Return the ReplayPlan of a BagReader.

    arguments: as of `fuzzy-stereo replay`, whose outputs were checked. asked: `asked_for` them.
    Raises ValueError and OSError for what cannot be done.
    """
    config, settings, reader = asked
    words = (*ALWAYS, *arguments.words)
    topics = chosen_topics(bags, arguments.left, arguments.right, settings['rectify'])
    infos, calibration = chosen_calibration(
        bags, topics, arguments, settings['rectify'] or settings['crop'])
    selection = chosen_part(bags, arguments.start, arguments.duration, arguments.every)
    copies = chosen_copies(bags, arguments.keep, words)
    storage = None if arguments.format == NO_BAG else arguments.format
    segments = SEGMENT_PAIRS if asks_for_cluster(arguments) else None
    folder = ReplayFolder(arguments.output, {
        'bags': [Path(bag).name for bag in arguments.bags], 'topics': topics._asdict(),
        'calibration': calibration, 'start': arguments.start, 'duration': arguments.duration,
        'every': arguments.every, 'format': arguments.format, 'results': words,
        'kept': sorted(copies.topics), 'files': arguments.files, 'settings': settings,
        'segments': segments,
        'matcher': asdict(replace(config, threads=0))},     # they change no result
        arguments.bags, arguments.overwrite, arguments.resume)
    if folder.continued:
        selection = selection._replace(done=done_before(
            folder.path, storage, arguments.files, WARM_PAIRS + (segments or 0)))
    return ReplayPlan(config, settings, reader, topics, copies, infos, calibration, selection,
                      words, storage, arguments.files, folder)


def asked_for(arguments):
    """Return the MatcherConfig, the {node parameter: value} and the PairReader of arguments."""
    settings = node_settings(arguments, (*SYNCHRONISING, *READING, *RESULTS))
    return (profile_config(arguments.profile, **matcher_changes(arguments)), settings,
            PairReader(*(settings[name] for name in READING)))


def is_lasting(arguments):
    """Return whether a bag or files are written, which --resume can go on with."""
    return arguments.format != NO_BAG or bool(arguments.files)


def check_outputs(arguments, asked):
    """
    Raise ValueError where nothing would be written, or what a file cannot hold.

    asked: `asked_for` the arguments.
    """
    config, _, reader = asked
    config = config.at_scale(reader.scale)
    if not is_lasting(arguments):
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
    if arguments.format == NO_BAG and arguments.words:
        raise ValueError(f'--with names topics of a bag, and --format {NO_BAG} writes none; '
                         'leave one of the two out')
    if 'png' in arguments.files and (
            config.min_disparity < 0 or config.min_disparity + config.disparities > 256):
        raise ValueError('--files png holds 0 to 255 px; min_disparity and disparities ask for '
                         'others: give npy or pfm')
