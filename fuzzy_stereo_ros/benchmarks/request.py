# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the suites share: the request, the trial of a matcher, times taken in turns."""
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
import time

from fuzzy_stereo_ros.benchmarks.datasets import available_scenes, available_sequences
from fuzzy_stereo_ros.benchmarks.pictures import as_svg
from fuzzy_stereo_ros.evaluation.baselines import opencv_threads
from fuzzy_stereo_ros.evaluation.ground_truth import bad_percent
from fuzzy_stereo_ros.evaluation.matchers import Ours
from fuzzy_stereo_ros.evaluation.report import environment, mean, Report
from fuzzy_stereo_ros.evaluation.scores import flicker
import numpy as np

QUICK_KINDS = 'window, noise 0, pan 0', 'window, noise 6, pan 2', 'hard cut'
NAN = float('nan')


@dataclass(frozen=True)
class Request:
    """
    The request of a benchmark.

    profile, changes: the matcher under test, changes being {parameter: value}.
    data: folder of the benchmark data, or None. only: a word that scenes must contain.
    repeats: how often a time is taken. follow(items, title): iterates and shows progress.
    quick: small and few, to see that all runs; the figures then say nothing.
    """

    profile: str = 'realtime'
    changes: dict = field(default_factory=dict)
    data: Path | None = None
    only: str = ''
    repeats: int = 15
    follow: Callable = field(default=lambda items, title: items)
    quick: bool = False

    @property
    def ours(self):
        """The matcher under test."""
        return Ours('ours', self.profile, self.changes)

    @property
    def subject(self):
        """The matcher under test in words."""
        return self.ours.description

    def config(self, disparities, **forced):
        """Return the configuration under test: dense, from 0, on one thread unless forced."""
        return self.ours.config(disparities, **forced)

    def matcher(self, disparities, **forced):
        """Return a `StereoMatcher` of the configuration under test."""
        return self.ours.matcher(disparities, **forced)

    def each(self, items, title, work):
        """Return [work(item)] of items in their order, OpenCV on one thread; progress is shown."""
        with opencv_threads(1):
            return [work(item) for item in self.follow(items, title)]

    def scenes(self):
        """Return the scenes that are asked for and here, and sentences about those missing."""
        return available_scenes(self.data, self.only, self.quick)

    def sequences(self, scenes):
        """Return the sequences that can be made here, and sentences about those missing."""
        if not self.quick:
            return available_sequences(self.data, scenes)
        found, _ = available_sequences(None, scenes)
        return [sequence for sequence in found if sequence.kind in QUICK_KINDS], []


def report_of(name, title, settings, tables, skipped, pictures=None, threads='one each'):
    """
    Return the `Report` of a suite, with the machine among its settings.

    pictures: {name of a file: function that returns the Figure of tables}. threads: of matchers.
    """
    drawn, missing = {}, []
    for file, draw in (pictures or {}).items():
        content, lacking = as_svg(file, partial(draw, tables))
        drawn.update(content)
        missing += lacking
    return Report(name, title, {**environment(threads), **settings}, tables,
                  [*skipped, *missing], drawn)


@dataclass(frozen=True)
class Trial:
    """
    The figures of a matcher on a scene or a sequence.

    error, error_of_all: percent of the pixels that count, and of all with a truth, that are bad.
    fitness, first_fitness: of the best, at the end and in the first generation.
    """

    error: float
    fitness: float = NAN
    milliseconds: float = NAN
    first_fitness: float = NAN
    error_of_all: float = NAN


@dataclass
class TimedMatcher:
    """
    A matcher whose time is taken.

    work: called with a frame's number; may return {stage: milliseconds}.
    times: milliseconds of each turn; processor_times: the same, of all threads together, not
    counting while other programs ran; stages: the minimum of each stage that was returned.
    """

    name: str
    work: Callable
    times: list = field(default_factory=list)
    processor_times: list = field(default_factory=list)
    stages: dict = field(default_factory=dict)

    def take_turn(self, frame):
        """Take the time of one frame."""
        start, processor_start = time.perf_counter(), time.process_time()
        stages = self.work(frame)
        self.processor_times.append(1000 * (time.process_time() - processor_start))
        self.times.append(1000 * (time.perf_counter() - start))
        for stage, milliseconds in (stages or {}).items():
            self.stages[stage] = min(milliseconds, self.stages.get(stage, milliseconds))

    @property
    def best(self):
        """The fastest turn, in milliseconds."""
        return min(self.times)

    @property
    def cores(self):
        """How many cores worked on average in the fastest turn."""
        return self.processor_times[int(np.argmin(self.times))] / self.best


def take_turns(matchers, turns, frames=1):
    """Let `TimedMatcher`s match frames in turns, after a first turn that takes memory."""
    for matcher in matchers:
        matcher.work(0)
    for turn in range(turns):
        for matcher in matchers:
            matcher.take_turn(turn % frames)


def scored_error(sequence, frames, maps):
    """Return the mean error, in percent, of the scored frames of a `Sequence` with a truth."""
    return mean(bad_percent(maps[number], frames[number], sequence.limit)
                for number in sequence.scored if frames[number].truth is not None)


def mean_flicker(sequence, maps):
    """Return the mean flicker, in percent, from the first scored frame of a `Sequence` on."""
    return mean(flicker(maps[number - 1], maps[number], (0, -sequence.pan))
                for number in range(max(1, sequence.scored.start), len(maps))
                if sequence.flickers)


def counted(frame, group='group', one='scene'):
    """Return a DataFrame with the number of scenes behind the names of groups; noise too."""
    named = frame[group] + ' (' + frame.groupby(group)[one].transform('nunique').astype(str) + ')'
    if 'noise' in frame and frame.noise.nunique() > 1:
        named += ', noise ' + frame.noise.map('{:g}'.format)
    return frame.assign(**{group: named})


def means(frame, figure, names, name='matcher'):
    """Return a DataFrame of the means of a figure: a row a group, a column for each of names."""
    return counted(frame).pivot_table(figure, 'group', name, sort=False).reindex(columns=names)


def halved(frame, name):
    """Return rows of groups with more than one scene, with a column `half`: odd or even."""
    several = frame[frame.groupby('group').scene.transform('nunique') > 1]
    place = several.groupby(['group', name]).cumcount()
    return several.assign(half=place.mod(2).map({0: 'odd', 1: 'even'}))
