# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The options of a replay: one value, checked before any bag is opened."""
from dataclasses import dataclass
import math
from pathlib import Path

from fuzzy_stereo_ros.matching import MatcherConfig
from fuzzy_stereo_ros.pairs.pair_reader import PairReader
from fuzzy_stereo_ros.pairs.result_messages import TOPICS
from fuzzy_stereo_ros.parameters.table import OUTPUTS

ALWAYS = 'disparity', 'preview'     # results that every bag has
BY_CHOICE = tuple(word for word in OUTPUTS if word not in ALWAYS)
NO_BAG = 'none'
VIEWER = 'the Rerun viewer'
SYNCHRONISING = ('queue_size', 'approximate_sync', 'approximate_sync_tolerance_seconds',
                 'cache_camera_info')
READING = 'rectify', 'crop', 'scale'
RESULTS = 'depth_encoding', 'use_color', 'avoid_point_cloud_padding'
WARM_PAIRS = 8      # matched again before what is new: frames that are averaged at the most
SEGMENT_PAIRS = 48  # long enough for warming up to cost a sixth, short enough to be held


@dataclass(frozen=True)
class ReplayOptions:
    """
    The options of a replay; ValueError where they contradict each other.

    bags: paths. output: folder, None for none. storage: of the bag, or NO_BAG. results: words of
    BY_CHOICE. keep: names of topics to be copied, () for all of them, None for none. files:
    suffixes of files of disparities. view: file, or VIEWER. left, right: names of image topics.
    start, duration: s. every: of so many pairs the first is matched. camera_info to
    principal_point: as `given_calibration` takes them. config: MatcherConfig of the images as
    they are. settings: {node parameter: value}, of SYNCHRONISING, READING and RESULTS.
    """

    bags: tuple[str, ...]
    config: MatcherConfig
    settings: dict
    output: str | None = None
    storage: str = 'mcap'
    results: tuple[str, ...] = ()
    keep: tuple[str, ...] | None = None
    files: tuple[str, ...] = ()
    video: str | None = None
    video_rate: float | None = None
    view: str | None = None
    overwrite: bool = False
    resume: bool = False
    left: str | None = None
    right: str | None = None
    start: float | None = None
    duration: float | None = None
    every: int = 1
    workers: int | None = None
    scheduler: str | None = None
    camera_info: tuple[str, ...] | None = None
    focal: float | None = None
    baseline: float | None = None
    offset: float | None = None
    principal_point: tuple[float, float] | None = None

    def __post_init__(self):
        self._check_outputs()
        self._check_views()
        if self.duration is not None and not (math.isfinite(self.duration) and self.duration > 0):
            raise ValueError(f'--duration is {self.duration:g}; allowed are numbers above 0')
        for name in ('every', 'workers'):
            value = getattr(self, name)
            if value is not None and value < 1:
                raise ValueError(f'--{name} is {value}; allowed are whole numbers from 1')
        if self.workers is not None and self.scheduler is not None:
            raise ValueError('--workers starts workers and --scheduler takes others: give one of '
                             'them')
        if self.overwrite and self.resume:
            raise ValueError('--overwrite begins anew and --resume goes on: give one of them')

    @property
    def writes_bag(self):
        """Whether a bag is written."""
        return self.storage != NO_BAG

    @property
    def can_be_resumed(self):
        """Whether what is written, a bag or files, can be continued."""
        return self.writes_bag or bool(self.files)

    @property
    def words(self):
        """The results of each pair in the bag: keys of result_messages.TOPICS."""
        return *ALWAYS, *self.results

    @property
    def result_topics(self):
        """The names of the topics of the results."""
        return {f'/{topic}' for word in self.words for topic, _ in TOPICS[word]}

    @property
    def views(self):
        """Files and viewers that show the pairs, in words."""
        return [name for name in (self.video, self.view) if name is not None]

    @property
    def in_segments(self):
        """Whether segments are matched on workers, instead of one chain here."""
        return self.workers is not None or self.scheduler is not None

    @property
    def scaled_config(self):
        """The MatcherConfig of the images as they are matched."""
        return self.config.at_scale(self.settings['scale'])

    def pair_reader(self):
        """Return the PairReader of the images."""
        return PairReader(*(self.settings[name] for name in READING))

    def _check_outputs(self):
        if not self.can_be_resumed:
            if not self.views:
                raise ValueError(f'--format {NO_BAG} leaves nothing to be written; give --files, '
                                 '--video or --view')
            if self.resume:
                raise ValueError('--resume goes on with a bag or with --files, and there is '
                                 'neither')
        elif self.output is None:
            raise ValueError('--output is missing; give a folder that is made for the results')
        if not self.writes_bag and self.keep is not None:
            raise ValueError(f'--keep copies into a bag, and --format {NO_BAG} writes none')
        if not self.writes_bag and self.results:
            raise ValueError(f'--with names topics of a bag, and --format {NO_BAG} writes none; '
                             'leave one of the two out')
        lowest, count = self.scaled_config.min_disparity, self.scaled_config.disparities
        if 'png' in self.files and (lowest < 0 or lowest + count > 256):
            raise ValueError('--files png holds 0 to 255 px; min_disparity and disparities ask '
                             'for others: give npy or pfm')

    def _check_views(self):
        if self.video_rate is not None and self.video is None:
            raise ValueError('--video-rate needs --video')
        for name in ('video', 'view'):
            path = getattr(self, name)
            if path in (None, VIEWER):
                continue
            if self.resume:
                raise ValueError(f'--resume cannot go on with {path}; leave out --{name}, or '
                                 'begin anew with --overwrite')
            if Path(path).exists() and not self.overwrite:
                raise ValueError(f'--{name} is {path}, which exists; give another file, or '
                                 '--overwrite')
