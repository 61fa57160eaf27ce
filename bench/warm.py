# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Warm start: error and flicker of the matcher with and without its previous frame, beside 3WAY.

Cold means that the matcher forgets the previous frame before each one, but keeps the rows that it
measured: these are of the cameras, and would be counted as of the warm start. Also the error over
the frames of a scene that stays or pans.
"""
from functools import partial

from bench.datasets import window
from bench.draws import in_words, means_over_draws
from bench.page import add_legend, BLUE, column, figure_of, LIGHT_BLUE, ORANGE, titled
from bench.request import counted, figures_of_sequence, report_of
from bench.scoring import bad_percent, REFERENCE, ScoredSequence
from fuzzy_stereo_ros.evaluation.baselines import dense
from fuzzy_stereo_ros.evaluation.ground_truth import MIDDLEBURY
from fuzzy_stereo_ros.evaluation.report import Table

COLD, WARM, BASELINE = 'cold', 'warm', '3WAY'
MATCHERS = BASELINE, COLD, WARM
GROUPS = 'middv2', 'midd2006_third'     # whose scenes are matched over frames
FRAMES, QUICK_FRAMES = (1, 2, 5, 10, 30), (1, 2)
# {kind: (noise in grey levels, pan in px a frame)}
KINDS = {'still, noise 0': (0, 0), 'still, noise 1.5': (1.5, 0), 'pan 2 px, noise 1.5': (1.5, 2)}
OVER_FRAMES = 'Error over frames, percent'
# {matcher: (colour, mark, words)}
MARKS = {BASELINE: (ORANGE, '^', 'OpenCV 3WAY tuned'),
         COLD: (LIGHT_BLUE, 's', 'ours, cold: each frame alone'),
         WARM: (BLUE, 'o', 'ours, warm: with the frame before')}


def run(request):
    """Return the `Report` of cold against warm on the sequences of a request."""
    scenes, skipped = request.scenes()
    sequences, missing = request.sequences(scenes)
    measured, walked = request.drawn(
        (sequences, 'warm', partial(measure, request.ours)),
        (walks(scenes, request.quick), 'over frames', partial(walk, request.ours)))
    settings = {
        'ours': f'{request.ours.description}, filled; cold: the frame before is forgotten, '
                'the rows measured are kept',
        'baseline': '3WAY, tuned for the family, dense',
        'window': 'the classic pairs through a window that pans so many pixels per frame, with '
                  'fresh noise of so many grey levels (standard deviation, alike in the three '
                  'channels); frames 2 to 5 of 0 to 5',
        'error': 'percent off by more than 1 px, of the pixels that both cameras see; KITTI: '
                 '3 px, pixels with truth that are visible (noc), of frame 10',
        'flicker': 'percent of pixels that change by more than 1 px, the pan taken out',
        **in_words(request.draws),
        'drive': 'cameras that drive through a street, turn, tilt and roll; the calibration is '
                 'given there, and for KITTI and EuRoC; backwards: from a frame to the one '
                 'before; pictured street: its planes carry pictures of scikit-image',
        'others': 'sharp texture: as sharp as a pixel, of like contrast everywhere, that pans; '
                  'hard cut: two frames of one scene, then one of another, which counts; object '
                  'appears: the frame in which it is there for the first time and the next',
    }
    return report_of('warm', 'Warm start', settings,
                     [table(measured), frames_table(walked)], [*skipped, *missing],
                     {'warm.svg': draw_warm, 'over_frames.svg': draw_over_frames},
                     sequences=measured, walks=walked)


def measure(ours, sequence, draw):
    """
    Return a list of the figures of a sequence, a dict: kind, path, two figures of each matcher.

    Name of the matcher: error in percent, NaN without truth. 'flicker, ' and the name: percentage
    of pixels that change by more than 1 px.
    """
    frames, maps = sequence.drawn(draw), {name: [] for name in MATCHERS}
    matchers = {name: ours.matcher(sequence.disparities, warm_start=True)
                for name in (COLD, WARM)}
    baseline = REFERENCE.matcher(sequence.family, sequence.disparities)
    for known in frames:
        matchers[COLD].restore(None, matchers[COLD].rows)
        for name, matcher in matchers.items():
            maps[name].append(matcher.match(known.left, known.right,
                                            camera=sequence.camera).disparity)
        maps[BASELINE].append(dense(baseline.match(known.left, known.right)))
    found = {name: figures_of_sequence(sequence, frames, several)
             for name, several in maps.items()}
    return [{'kind': sequence.group, 'path': sequence.path,
             **{name: figures['error'] for name, figures in found.items()},
             **{f'flicker, {name}': figures['flicker'] for name, figures in found.items()}}]


def table(found):
    """Return the table of a DataFrame of figures of `measure`."""
    kinds = counted(found, 'kind', 'path')
    return Table.of('Error and flicker, percent', means_over_draws(kinds, ['kind'], [
        *MATCHERS, *(f'flicker, {name}' for name in MATCHERS)]))


def walks(scenes, quick, kinds=KINDS, frames=FRAMES[-1], every=1):
    """
    Return a `ScoredSequence` of each scene, still or panning, for each of the kinds.

    every: one in so many scenes
    """
    classic = [scene for scene in scenes if scene.group in GROUPS] or [
        scene for scene in scenes if scene.family == MIDDLEBURY]
    classic, frames = (classic[:1], QUICK_FRAMES[-1]) if quick else (classic[::every], frames)
    return [ScoredSequence(
        f'{scene.group}, {kind}', scene.name, scene.family, scene.disparities,
        partial(window, scene, KINDS[kind][1], frames), noise=KINDS[kind][0],
        scored=range(frames - 1, frames)) for scene in classic for kind in kinds]


def walk(ours, one, draw):
    """Match the frames of a walk warm; return a list of a dict: kind, scene, errors of FRAMES."""
    matcher, errors = ours.matcher(one.disparities, warm_start=True), {}
    for number, known in enumerate(one.drawn(draw), 1):
        match = matcher.match(known.left, known.right)
        if number in FRAMES:
            errors[f'frame {number}'] = bad_percent(match.disparity, known, one.limit)
    return [{'kind': one.group, 'scene': one.name, **errors}]


def frames_table(walked):
    """Return the table of a DataFrame of figures of `walk`."""
    return Table.of(OVER_FRAMES, means_over_draws(counted(walked, 'kind'), ['kind']))


def draw_warm(tables):
    """Return the Figure of the table of error and flicker: lines from cold to warm."""
    table = titled(tables, 'Error and flicker')
    kinds = [row[0] for row in table.rows]
    figure = figure_of(8.4, 1.7 + 0.24 * len(kinds), 'With and without the frame before: lower is '
                       'better')
    panels = figure.subplots(1, 2, sharey=True)
    for panel, (title, heading) in zip(panels, {
            'error [% of pixels]': '{}', 'flicker [% of pixels that change]': 'flicker, {}'
            }.items()):
        figures = {name: column(table, heading.format(name)) for name in MARKS}
        for place, kind in enumerate(kinds):
            panel.plot([figures['cold'][kind], figures['warm'][kind]], [place, place], '-',
                       color=LIGHT_BLUE, linewidth=2.5)
        for name, (colour, mark, label) in MARKS.items():
            panel.plot([figures[name][kind] for kind in kinds], range(len(kinds)), mark,
                       color=colour, markersize=5.5, label=label)
        panel.set_title(title, loc='left')
        panel.grid(alpha=0.3)
        panel.set_xlim(left=-1)
    panels[0].set_yticks(range(len(kinds)), kinds)
    panels[0].set_ylim(len(kinds) - 0.5, -0.5)
    add_legend(figure)
    return figure


def draw_over_frames(tables):
    """Return the Figure of the table of error over frames: a panel per group, a line per kind."""
    found = titled(tables, OVER_FRAMES)
    frames = [int(name.split()[1]) for name in found.columns[1:]]
    groups = list(dict.fromkeys(row[0].split(',')[0] for row in found.rows))
    figure = figure_of(4.2 * max(len(groups), 2), 3.6,
                       'Each frame is a generation: error over frames')
    panels = figure.subplots(1, len(groups), squeeze=False)[0]
    for panel, group in zip(panels, groups):
        rows = [row for row in found.rows if row[0].split(',')[0] == group]
        for row, colour in zip(rows, (BLUE, LIGHT_BLUE, ORANGE)):
            panel.plot(frames, row[1:], 'o-', color=colour, markersize=4,
                       label=row[0].split(', ', 1)[1])
        panel.set_xscale('log')
        panel.set_xticks(frames, frames)
        panel.set_title(group, loc='left')
        panel.set_xlabel('frame')
        panel.set_ylim(bottom=0)
        panel.grid(alpha=0.3)
    panels[0].set_ylabel('off by more than 1 px [%]')
    add_legend(figure, 2)
    return figure
