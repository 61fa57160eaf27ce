# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Error over the frames of a sequence: how much a scene that stays, or pans, gets better."""
from typing import NamedTuple

from fuzzy_stereo_ros.benchmarks.datasets import window
from fuzzy_stereo_ros.benchmarks.pictures import OURS, OURS_LIGHT, titled, TUNED
from fuzzy_stereo_ros.evaluation.ground_truth import bad_percent, MIDDLEBURY
from fuzzy_stereo_ros.evaluation.report import Table
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
import numpy as np

GROUPS = 'middv2', 'midd2006_third'
FRAMES, QUICK_FRAMES = (1, 2, 5, 10, 30), (1, 2)
KINDS = {'still, noise 0': (0, 0), 'still, noise 1.5': (1.5, 0), 'pan 2 px, noise 1.5': (1.5, 2)}
COLOURS = OURS, OURS_LIGHT, TUNED
TITLE = 'Error over frames'


class Walk(NamedTuple):
    """A scene seen for some frames; errors: percent, of the frames that are shown."""

    scene: object
    kind: str
    errors: list

    @property
    def path(self):
        """What is shown while it runs."""
        return f'{self.kind}, {self.scene.name}'


def walks(request, scenes):
    """Return a `Walk`, not walked yet, for each kind and scene of a request."""
    classic = [scene for scene in scenes if scene.group in GROUPS] or [
        scene for scene in scenes if scene.family == MIDDLEBURY]
    return [Walk(scene, kind, []) for scene in (classic[:1] if request.quick else classic)
            for kind in KINDS]


def walk(request, one):
    """Match the frames of a `Walk` warm, and write its errors."""
    shown = QUICK_FRAMES if request.quick else FRAMES
    matcher = request.matcher(one.scene.disparities, warm_start=True)
    for number, known in enumerate(window(one.scene, *KINDS[one.kind], shown[-1]), 1):
        match = matcher.match(known.left, known.right)
        if number in shown:
            one.errors.append(bad_percent(match.disparity, known, one.scene.limit))
    return one


def quality_errors(scenes):
    """Return {scene: percent} of the profile `quality` on one frame without noise."""
    found = {}
    for scene in scenes:
        known = scene.read()
        matcher = StereoMatcher(MatcherConfig.from_profile(
            'quality', disparities=scene.disparities, threads=1, fill=True))
        found[scene] = bad_percent(matcher.match(known.left, known.right).disparity, known,
                                   scene.limit)
    return found


def table(walked, quality):
    """Return the table of a list of `Walk`s, and of quality_errors."""
    rows = []
    for group in dict.fromkeys(one.scene.group for one in walked):
        for kind in KINDS:
            found = [one for one in walked if (one.scene.group, one.kind) == (group, kind)]
            rows.append((f'{group} ({len(found)}), {kind}', *map(float, np.mean(
                [one.errors for one in found], axis=0)), float(np.mean(
                    [quality[one.scene] for one in found]))))
    shown = FRAMES if len(walked[0].errors) == len(FRAMES) else QUICK_FRAMES
    return Table(f'{TITLE}, percent', ('', *(f'frame {number}' for number in shown),
                                       'quality, one frame without noise'), rows)


def draw(tables):
    """Return the Figure of the table: a panel a group, a line a kind."""
    from matplotlib.figure import Figure

    found = titled(tables, TITLE)
    frames = [int(name.split()[1]) for name in found.columns[1:-1]]
    groups = list(dict.fromkeys(row[0].split(',')[0] for row in found.rows))
    figure = Figure(figsize=(4.2 * max(len(groups), 2), 3.6), layout='constrained')
    figure.suptitle('Each frame is a generation: error over frames', fontsize=11)
    panels = figure.subplots(1, len(groups), squeeze=False)[0]
    for panel, group in zip(panels, groups):
        rows = [row for row in found.rows if row[0].split(',')[0] == group]
        for row, colour in zip(rows, COLOURS):
            panel.plot(frames, row[1:-1], 'o-', color=colour, markersize=4,
                       label=row[0].split(', ', 1)[1])
        panel.axhline(rows[0][-1], color='#7a7a7a', linestyle=':', linewidth=1.2,
                      label='quality, one frame without noise')
        panel.set_xscale('log')
        panel.set_xticks(frames, frames)
        panel.set_title(group, loc='left')
        panel.set_xlabel('frame')
        panel.set_ylim(bottom=0)
        panel.grid(alpha=0.3)
    panels[0].set_ylabel('off by more than 1 px [%]')
    figure.legend(*panels[0].get_legend_handles_labels(), loc='outside lower center', ncols=2,
                  frameon=False)
    return figure
