# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Warm start: error and flicker of the matcher with and without its previous frame, beside 3WAY.

Cold means that the matcher forgets the previous frame before each one, but keeps the rows that it
measured: these are of the cameras, and would be counted as of the warm start. Also the error over
the frames of a scene that stays or pans.
"""
from functools import partial

from bench.datasets import MADE, MADE_SEEDS, window
from bench.draws import in_words, means_over_draws
from bench.layers import BACKGROUND, make_layers
from bench.page import add_legend, BLUE, column, figure_of, GREY, LIGHT_BLUE, ORANGE, titled
from bench.request import counted, figures_of_sequence, report_of
from bench.scoring import bad_percent, REFERENCE, ScoredPair, ScoredSequence
from fuzzy_stereo_ros.evaluation.baselines import dense
from fuzzy_stereo_ros.evaluation.ground_truth import MIDDLEBURY
from fuzzy_stereo_ros.evaluation.matchers import fastest, Ours
from fuzzy_stereo_ros.evaluation.report import Table
import numpy as np

COLD, WARM, BASELINE = 'cold', 'warm', '3WAY'
MATCHERS = BASELINE, COLD, WARM
MORE = 'warm - cold'
MOST = 5        # rows of the table of sequences where the warm start costs most
GROUPS = 'middv2', 'midd2006_third'     # whose scenes are matched over frames
FRAMES, QUICK_FRAMES = (1, 2, 5, 10, 30), (1, 2)
# {kind: (noise in grey levels, pan in px a frame)}
KINDS = {'still, noise 0': (0, 0), 'still, noise 1.5': (1.5, 0), 'pan 2 px, noise 1.5': (1.5, 2)}
OVER_FRAMES = 'Error over frames'       # start of the title of its table
# contrast in grey levels and px a frame of objects that come nearer
SLOW = (8, 0.01), (8, 0.02), (8, 0.05), (5, 0.02), (5, 0.05), (5, 0.1)
SLOW_NOISE, SLOW_BLUR, SLOW_FRAMES, SLOW_SCORED = 2.0, 1.5, 40, 4     # from frame 4 on
OUTLIER = 2.0       # px from which an error is no bias
QUALITY = 'quality, one frame without noise'
QUALITY_KIND, QUALITY_FRAMES, QUALITY_SHOWN = 'still, noise 1.5', 8, (2, 5, 8)
QUALITY_DRIVES = 'KITTI drive', 'KITTI drive, noise 3', 'made, drive', 'made, object appears'
# {matcher: (colour, mark, words)}
MARKS = {BASELINE: (ORANGE, '^', 'OpenCV 3WAY tuned'),
         COLD: (LIGHT_BLUE, 's', 'ours, cold: each frame alone'),
         WARM: (BLUE, 'o', 'ours, warm: with the frame before')}


def run(request):
    """Return the `Report` of cold against warm on the sequences of a request."""
    scenes, skipped = request.scenes()
    sequences, missing = request.sequences(scenes)
    measured, walked, slow, quality = request.drawn(
        (sequences, 'warm', partial(measure, request.ours)),
        (walks(scenes, request.quick), 'over frames', partial(walk, request.ours)),
        (slow_ones(request.quick), 'slow', partial(approach, request.ours)),
        (courses_of_quality(scenes, sequences, request.quick), 'quality', follow_quality))
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
                 'given there, and for KITTI and EuRoC; backwards: from a frame to the one before',
        'pictured street': 'a drive through a street whose planes carry pictures of scikit-image',
        'sharp texture': 'texture as sharp as a pixel, of like contrast everywhere, that pans',
        'hard cut': 'two frames of one scene, then one of another, which counts',
        'object appears': 'the frame in which it is there for the first time and the next',
    }
    return report_of('warm', 'Warm start', settings,
                     [*tables(measured), slow_table(slow), frames_table(walked),
                      quality_table(quality)],
                     [*skipped, *missing],
                     {'warm.svg': draw_warm, 'over_frames.svg': draw_over_frames})


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


def tables(found):
    """Return the tables of a DataFrame of figures of `measure`."""
    found = found.assign(**{MORE: found[WARM] - found[COLD]})
    costly = means_over_draws(found.dropna(subset=MORE), ['path'], [COLD, WARM, MORE]).sort_values(
        [MORE, COLD, WARM, 'path'], ascending=False)
    kinds = counted(found, 'kind', 'path')
    means = means_over_draws(kinds, ['kind'], [
        *MATCHERS, *(f'flicker, {name}' for name in MATCHERS)])
    means['warm / cold'] = means[WARM] / means[COLD].where(means[COLD] > 0)
    means['worst warm - cold'] = kinds.groupby('kind')[MORE].max()
    return [
        Table.of('Error and flicker, percent', means[[
            *MATCHERS, 'warm / cold', 'worst warm - cold',
            *(f'flicker, {name}' for name in MATCHERS)]],
            '*Worst warm - cold*: in a draw of a single sequence of the line, in points.'),
        Table.of('The sequences where the warm start costs most', costly.head(MOST))]


def slow_ones(quick):
    """Return a `ScoredSequence` of objects that come nearer for each of SLOW and of the seeds."""
    return [ScoredSequence(
        f'contrast {contrast}, {speed:g} px a frame', f'seed {seed}', MIDDLEBURY,
        MADE['disparities'], partial(approaching, contrast, speed, seed), noise=SLOW_NOISE)
        for contrast, speed in (SLOW[:1] if quick else SLOW)
        for seed in (MADE_SEEDS[:1] if quick else MADE_SEEDS)]


def approaching(contrast, speed, seed):
    """Return frames of objects that come nearer; contrast: grey levels; speed: px a frame."""
    return [ScoredPair(*made) for made in make_layers(
        MADE['rows'], MADE['columns'], SLOW_FRAMES, seed, contrast, SLOW_BLUR, approach=speed)]


def approach(ours, sequence, draw):
    """
    Return a list of a dict of objects that come nearer: kind, seed, mean bias of matchers in px.

    lowest: the bias of the warm matcher in the frame where it is the lowest
    """
    biases = {name: [] for name in (COLD, WARM)}
    matchers = {name: ours.matcher(sequence.disparities, warm_start=True) for name in biases}
    for made in sequence.drawn(draw):
        matchers[COLD].restore(None, matchers[COLD].rows)
        for name, matcher in matchers.items():
            off = matcher.match(made.left, made.right).disparity - made.truth
            counts = made.counts & (made.truth > BACKGROUND) & (abs(off) < OUTLIER)
            biases[name].append(off[counts].mean())
    scored = {name: found[SLOW_SCORED:] for name, found in biases.items()}
    return [{'kind': sequence.group, 'seed': sequence.name, 'lowest': min(scored[WARM]),
             **{name: float(np.mean(found)) for name, found in scored.items()}}]


def slow_table(measured):
    """Return the table of a DataFrame of figures of `approach`."""
    found = counted(measured, 'kind', 'seed')
    errors, lowest = means_over_draws(found, ['kind'], [COLD, WARM], 'min'), found.groupby(
        'kind').min()
    errors['warm, worst sequence'] = lowest[WARM]
    errors['warm, worst frame'] = lowest.lowest
    return Table.of(
        'Objects that come nearer slowly: mean error in px', errors,
        f'Below 0: seen too far away. Noise {SLOW_NOISE:g} grey levels; errors below '
        f'{OUTLIER:g} px, from frame {SLOW_SCORED} on.')


def walks(scenes, quick, kinds=KINDS, frames=FRAMES[-1]):
    """Return a `ScoredSequence` of each scene, still or panning, for each of the kinds."""
    classic = [scene for scene in scenes if scene.group in GROUPS] or [
        scene for scene in scenes if scene.family == MIDDLEBURY]
    classic, frames = (classic[:1], QUICK_FRAMES[-1]) if quick else (classic, frames)
    return [ScoredSequence(
        f'{scene.group}, {kind}', scene.name, scene.family, scene.disparities,
        partial(window, scene, KINDS[kind][1], frames), noise=KINDS[kind][0],
        scored=range(frames - 1, frames)) for scene in classic for kind in kinds]


def walk(ours, one, draw):
    """
    Match the frames of a walk warm; return a list of a dict: kind, scene and errors in percent.

    Of FRAMES, and without noise of the profile `quality` on one frame.
    """
    matcher, errors = ours.matcher(one.disparities, warm_start=True), {}
    for number, known in enumerate(one.drawn(draw), 1):
        match = matcher.match(known.left, known.right)
        if number in FRAMES:
            errors[f'frame {number}'] = bad_percent(match.disparity, known, one.limit)
    errors[QUALITY] = None if one.noise else _of_quality(one)
    return [{'kind': one.group, 'scene': one.name, **errors}]


def _of_quality(walk):
    """Return the error of the profile `quality` on one frame without noise."""
    clean = walk.read()[0]
    return bad_percent(Ours('quality', 'quality').matcher(walk.disparities).match(
        clean.left, clean.right).disparity, clean, walk.limit)


def frames_table(walked):
    """Return the table of a DataFrame of figures of `walk`."""
    quality = walked.groupby('scene')[QUALITY].transform('first')
    return Table.of(f'{OVER_FRAMES}, percent', means_over_draws(counted(walked.assign(
        **{QUALITY: quality.where(walked.draw == 0)}), 'kind'), ['kind']))


def courses_of_quality(scenes, sequences, quick):
    """Return what the profile `quality` is measured on: a walk of each other scene, drives."""
    still = walks(scenes, quick, [QUALITY_KIND], QUALITY_FRAMES)
    return [*still[:4], *still[5::4], *(one for one in sequences if one.group in QUALITY_DRIVES)]


def follow_quality(course, draw):
    """
    Match the frames of a sequence by the profile `quality`; return a list of a dict of figures.

    frame N: error in percent, last: of the last frame; cold, clean: of the last frame alone, as
    it is and without noise; flicker: percent of pixels that change by more than 1 px between the
    last two frames; time / cold: processor time of the last frame by that of the cold one
    """
    walking, frames = course.group.endswith(QUALITY_KIND), course.drawn(draw)
    matchers = [Ours('quality', 'quality').matcher(course.disparities, warm_start=warm)
                for warm in (True, False)]
    found, maps = {'kind': course.group, 'scene': course.name}, ([], [])
    for number, known in enumerate(frames, 1):
        last, milliseconds = number == len(frames), [None, None]
        for side, matcher in enumerate(matchers):
            if side and number < len(frames) - 1:
                continue
            match, milliseconds[side] = fastest(partial(
                matcher.match, known.left, known.right, camera=course.camera), 1, processor=True)
            maps[side].append(match.disparity)
        if walking and number in QUALITY_SHOWN:
            found[f'frame {number}'] = bad_percent(maps[0][-1], known, course.limit)
        if last:
            found['last'], found['cold'] = (
                bad_percent(several[-1], known, course.limit) for several in maps)
            found['time / cold'] = milliseconds[0] / milliseconds[1]
    if walking:
        found['clean'] = None if draw else _of_quality(course)      # the same for all draws
        for name, several in zip(('flicker', 'flicker, cold'), maps):
            found[name] = 100 * float(np.mean(abs(several[-1] - several[-2]) > 1))
    return [found]


def quality_table(measured):
    """Return the table of a DataFrame of figures of `follow_quality`."""
    return Table.of('Profile quality over frames: error and flicker, percent',
                    means_over_draws(counted(measured, 'kind'), ['kind']),
                    'Cold: the last frame alone; clean: the scene without noise; last: with the '
                    'frames before.')


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
    frames = [int(name.split()[1]) for name in found.columns[1:-1]]
    groups = list(dict.fromkeys(row[0].split(',')[0] for row in found.rows))
    figure = figure_of(4.2 * max(len(groups), 2), 3.6,
                       'Each frame is a generation: error over frames')
    panels = figure.subplots(1, len(groups), squeeze=False)[0]
    for panel, group in zip(panels, groups):
        rows = [row for row in found.rows if row[0].split(',')[0] == group]
        for row, colour in zip(rows, (BLUE, LIGHT_BLUE, ORANGE)):
            panel.plot(frames, row[1:-1], 'o-', color=colour, markersize=4,
                       label=row[0].split(', ', 1)[1])
        panel.axhline(rows[0][-1], color=GREY, linestyle=':', linewidth=1.2,
                      label=found.columns[-1])
        panel.set_xscale('log')
        panel.set_xticks(frames, frames)
        panel.set_title(group, loc='left')
        panel.set_xlabel('frame')
        panel.set_ylim(bottom=0)
        panel.grid(alpha=0.3)
    panels[0].set_ylabel('off by more than 1 px [%]')
    add_legend(figure, 2)
    return figure
