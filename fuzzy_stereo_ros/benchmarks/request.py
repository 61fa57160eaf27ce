# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the suites share: the request, the report, figures of sequences, means of groups."""
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from fuzzy_stereo_ros.benchmarks.datasets import available_scenes, available_sequences
from fuzzy_stereo_ros.benchmarks.page import as_svg
from fuzzy_stereo_ros.evaluation.baselines import opencv_threads
from fuzzy_stereo_ros.evaluation.ground_truth import bad_percent
from fuzzy_stereo_ros.evaluation.matchers import Ours
from fuzzy_stereo_ros.evaluation.report import environment, mean, Report
from fuzzy_stereo_ros.evaluation.scores import flicker


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

    def matcher(self, disparities, **forced):
        """Return a `StereoMatcher` under test: dense, from 0, on one thread unless forced."""
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
        return available_sequences(self.data, scenes, self.quick)


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


def figures_of_sequence(sequence, frames, maps):
    """
    Return the error and the flicker of maps of the frames of a `Sequence`, in percent, as a dict.

    error: mean of the scored frames with a truth; flicker: mean from the first scored frame on,
    the pan taken out. NaN of none.
    """
    scored = [number for number in sequence.scored if frames[number].truth is not None]
    return {'error': mean(bad_percent(maps[number], frames[number], sequence.limit)
                          for number in scored),
            'flicker': mean(flicker(maps[number - 1], maps[number], (0, -sequence.pan))
                            for number in range(max(1, sequence.scored.start), len(maps))
                            if sequence.flickers)}


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
