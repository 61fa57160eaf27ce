# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The options of a replay: one frozen value, checked before any bag is opened."""
from dataclasses import dataclass, fields
import math
from pathlib import Path

from fuzzy_stereo_ros.matching import MatcherConfig
from fuzzy_stereo_ros.pairs.result_messages import POINT_SETTINGS
from fuzzy_stereo_ros.parameters.options import CameraOptions
from fuzzy_stereo_ros.parameters.table import OUTPUTS

USUAL_RESULTS = 'disparity', 'preview'      # every bag has these
OPTIONAL_RESULTS = tuple(word for word in OUTPUTS if word not in USUAL_RESULTS)
NO_BAG = 'none'
SYNCHRONISING = ('queue_size', 'approximate_sync', 'approximate_sync_tolerance_seconds',
                 'cache_camera_info')
READING = 'rectify', 'crop', 'scale'
RESULTS = 'depth_encoding', *POINT_SETTINGS
WARM_PAIRS = 8      # warm-up pairs before new ones: the matcher averages no more frames
SEGMENT_PAIRS = 48  # warming up costs a sixth, and a segment fits into memory


@dataclass(frozen=True)
class ReplayOptions:
    """The options of a replay, None = not given; ValueError if they contradict each other."""

    bags: tuple[str, ...]       # paths, also of Frames
    config: MatcherConfig       # of the images at full scale
    settings: dict              # {node parameter: value}: SYNCHRONISING, READING, RESULTS
    output: str | None = None   # folder
    storage: str = 'mcap'       # of the bag, or NO_BAG
    results: tuple[str, ...] = ()           # words of OPTIONAL_RESULTS
    keep: tuple[str, ...] | None = None     # topics to copy, () = all, None = none
    files: tuple[str, ...] = ()             # suffixes of disparity files
    video: str | None = None
    overwrite: bool = False
    resume: bool = False
    left: str | None = None     # topics of images
    right: str | None = None
    start: float | None = None  # s
    duration: float | None = None
    every: int = 1              # match only each N-th pair
    workers: int | None = None  # processes
    scheduler: str | None = None            # address
    cameras: CameraOptions = CameraOptions()
    rate: float | None = None   # of Frames, per second; None = as they are stamped

    def __post_init__(self):
        self._check_outputs()
        if self.video is not None and self.resume:
            raise ValueError(f'--resume cannot continue {self.video}; leave out --video, or start '
                             'over with --overwrite')
        if self.video is not None and Path(self.video).exists():
            self._check_replaced(Path(self.video).resolve())
        if self.duration is not None and not (math.isfinite(self.duration) and self.duration > 0):
            raise ValueError(f'--duration is {self.duration:g}; allowed are numbers above 0')
        for name in ('every', 'workers'):
            value = getattr(self, name)
            if value is not None and value < 1:
                raise ValueError(f'--{name} is {value}; allowed are whole numbers from 1')
        if self.workers is not None and self.scheduler is not None:
            raise ValueError('--workers starts workers, --scheduler uses those of a cluster: give '
                             'one of them')
        if self.overwrite and self.resume:
            raise ValueError('--overwrite starts over and --resume continues: give one of them')

    @classmethod
    def of(cls, arguments, **others):
        """Return those of parsed arguments of the same names, lists as tuples; others: fields."""
        given = {field.name: getattr(arguments, field.name) for field in fields(cls)
                 if hasattr(arguments, field.name)}
        return cls(cameras=CameraOptions.of(arguments), **{
            name: tuple(value) if isinstance(value, list) else value
            for name, value in {**given, **others}.items()})

    @property
    def writes_bag(self):
        return self.storage != NO_BAG

    @property
    def can_be_resumed(self):
        """Whether --resume can continue the outputs: a bag or files."""
        return self.writes_bag or bool(self.files)

    @property
    def bag_results(self):
        """The results that the bag has of each pair: keys of result_messages.TOPICS."""
        return *USUAL_RESULTS, *self.results

    @property
    def in_segments(self):
        """Whether workers match segments, instead of this process one pair after the other."""
        return self.workers is not None or self.scheduler is not None

    @property
    def scaled_config(self):
        """The MatcherConfig of the images at the scale at which they are matched."""
        return self.config.at_scale(self.settings['scale'])

    def _check_replaced(self, video):
        for bag in map(Path, self.bags):
            if video.is_relative_to(bag.resolve()):
                raise ValueError(f'--video is {self.video}, which is of the input {bag}; give '
                                 'another file')
        if not self.overwrite:
            raise ValueError(f'--video is {self.video}, which exists; give another file, or '
                             '--overwrite')

    def _check_outputs(self):
        if not self.can_be_resumed:
            if self.video is None:
                raise ValueError(f'--format {NO_BAG} leaves no output; give --files or --video')
            if self.resume:
                raise ValueError('--resume continues a bag or --files; there is neither')
        elif self.output is None:
            raise ValueError('--output is missing; give a new folder for the results')
        for given, what in ((self.keep is not None, '--keep copies topics into a bag'),
                            (self.results, '--with adds topics to a bag')):
            if given and not self.writes_bag:
                raise ValueError(f'{what}, but --format {NO_BAG} writes none; leave one of the '
                                 'two out')
        lowest, count = self.scaled_config.min_disparity, self.scaled_config.disparities
        if 'png' in self.files and (lowest < 0 or lowest + count > 256):
            raise ValueError('--files png holds 0 to 255 px, but min_disparity and disparities go '
                             'beyond that: give npy or pfm')
