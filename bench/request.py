# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Shared parts of the suites: request, report, figures of sequences, means of groups."""
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from multiprocessing import get_context
import os
from pathlib import Path
import shutil
import signal
import subprocess
from typing import NamedTuple

from bench.datasets import available_scenes, available_sequences
from bench.draws import DRAWS, means_over_draws
from bench.page import as_svg
from bench.scoring import bad_percent
import fuzzy_stereo_ros
from fuzzy_stereo_ros.evaluation.baselines import opencv_threads
from fuzzy_stereo_ros.evaluation.catalogue import Scene
from fuzzy_stereo_ros.evaluation.matchers import Ours
from fuzzy_stereo_ros.evaluation.report import environment, Report
from fuzzy_stereo_ros.evaluation.scores import flicker, mean
import pandas as pd


@dataclass(frozen=True)
class Request:
    """
    The request of a benchmark.

    ours: the matcher under test. data: folder of the benchmark data, or None. only: a word that
    names of scenes must contain. repeats: number of measurements of a time. follow(items, title):
    iterates and shows progress. quick: small and few scenes, to see that everything runs; the
    figures then mean nothing. draws: of noise. python: another one, whose libraries are timed too.
    """

    ours: Ours = Ours('ours')
    data: Path | None = None
    only: str = ''
    repeats: int = 60
    follow: Callable = field(default=lambda items, title: items)
    quick: bool = False
    draws: int = DRAWS
    python: str | None = None

    def each(self, items, title, work):
        """Return [work(item)] of items, with OpenCV on one thread; shows progress."""
        with opencv_threads(1):
            return [work(item) for item in self.follow(items, title)]

    def drawn(self, *works):
        """
        Return a DataFrame for each (items, title, work): the rows of all work(item, draw).

        work: returns a list of dicts; a column `draw` is added. Items with `noise` are matched for
        each draw, others for draw 0 alone: by as many processes as there are cores.
        """
        found = []
        # An interrupt is left to this process, which ends the others.
        with get_context('spawn').Pool(len(os.sched_getaffinity(0)), signal.signal,
                                       (signal.SIGINT, signal.SIG_IGN)) as pool:
            for items, title, work in works:
                tasks = [(item, draw) for item in items
                         for draw in range(self.draws if getattr(item, 'noise', 0) else 1)]
                done = pool.imap(partial(_rows, work), tasks)
                found.append(pd.DataFrame([
                    row for _ in self.follow([item for item, _ in tasks], title)
                    for row in next(done)]))
        return found

    def scenes(self):
        """Return the requested scenes that are available, and sentences about missing ones."""
        return available_scenes(self.data, self.only, self.quick)

    def sequences(self, scenes):
        """Return the available sequences, and sentences about missing ones."""
        return available_sequences(self.data, scenes, self.quick)


class Subject(NamedTuple):
    """A scene under a condition; noise: whether, or by how many grey levels, it is random."""

    scene: Scene
    condition: str
    noise: float

    @property
    def path(self):
        """Scene and condition, as progress shows them."""
        return f'{self.scene.path}, {self.condition}'


def _rows(work, task):
    """Return the rows of a task, with its draw, and with OpenCV on one thread."""
    with opencv_threads(1):
        return [{**row, 'draw': task[1]} for row in work(*task)]


@dataclass(frozen=True)
class Measured(Report):
    """The `Report` of a suite; figures: {name: DataFrame} of what its tables are the means of."""

    figures: dict = field(default_factory=dict)

    def write_figures(self, folder):
        """Write each of the figures, if there are any, as a CSV file into a folder."""
        for name, figures in self.figures.items():
            if len(figures):
                figures.to_csv(Path(folder) / f'{self.name}_{name}.csv', index=False)


def report_of(name, title, settings, tables, skipped, pictures=None, threads='one each',
              **figures):
    """
    Return the `Measured` report of a suite; adds the machine to its settings.

    pictures: {name of a file: function from tables to a Figure}. threads: of the matchers.
    figures: see `Measured`
    """
    drawn, missing = {}, []
    for file, draw in (pictures or {}).items():
        content, lacking = as_svg(file, partial(draw, tables))
        drawn.update(content)
        missing += lacking
    return Measured(name, title, {**measured(threads), **settings}, tables,
                    [*skipped, *missing], drawn, figures)


def measured(threads):
    """Return {what: words} of a measurement: machine, versions, commit, threads and load."""
    found = environment(threads)
    found['machine'] += f"; {found.pop('load')}"
    return {'commit': commit_of(Path(fuzzy_stereo_ros.__file__).parent), **found}


def commit_of(folder):
    """Return the last commit that changed a folder, in words."""
    git = shutil.which('git')
    answers = [subprocess.run([git, *words, '--', '.'], cwd=folder, capture_output=True, text=True)
               for words in (('log', '-1', '--format=%h, %as'), ('status', '--porcelain')) if git]
    if not git or any(answer.returncode for answer in answers):
        return 'unknown, this is no checkout'
    commit, changed = (answer.stdout.strip() for answer in answers)
    return f'{commit}, with changes' if changed else commit


def figures_of_sequence(sequence, frames, maps):
    """
    Return {'error': percent, 'flicker': percent} of the maps of the frames of a `ScoredSequence`.

    error: mean of the scored frames with a truth. flicker: mean from the first scored frame on,
    with the pan removed. NaN if there are no such frames.
    """
    scored = [number for number in sequence.scored if frames[number].truth is not None]
    return {'error': mean(bad_percent(maps[number], frames[number], sequence.limit)
                          for number in scored),
            'flicker': mean(flicker(maps[number - 1], maps[number], (0, -sequence.pan))
                            for number in range(max(1, sequence.scored.start), len(maps))
                            if sequence.flickers)}


def counted(frame, group='group', one='scene'):
    """Return a DataFrame whose names of groups end with the number of scenes, and the noise."""
    named = frame[group] + ' (' + frame.groupby(group)[one].transform('nunique').astype(str) + ')'
    if 'noise' in frame and frame.noise.nunique() > 1:
        named += ', noise ' + frame.noise.map('{:g}'.format)
    return frame.assign(**{group: named})


def means(frame, names):
    """Return a DataFrame of the mean errors: a row per group, a column per matcher."""
    found = means_over_draws(counted(frame), ['group', 'matcher'], ['error']).error
    return found.unstack('matcher', sort=False).reindex(columns=names)
