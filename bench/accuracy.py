# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Accuracy: dense errors on every scene with one setting, side by side with OpenCV's matchers.

Middlebury scenes are scored by bad-1 over the pixels that both cameras see, KITTI by bad-3 over
all pixels with truth. Means of odd and of even scenes allow to check on one half the settings
chosen on the other. Everything is repeated with camera noise, on the same images for all matchers.
"""
from functools import partial

from bench.confidence import (
    CONFIDENCES, kept_and_wrong, kept_of, left_right_sureness, pairs_without_truth, reliability,
    sparsification, table_with_truth, table_without_truth, wrong_and_confidence)
from bench.draws import in_words, means_over_draws, with_draw
from bench.page import (
    add_legend, BLUE, column, figure_of, GREY, LIGHT_BLUE, LIGHT_GREY, LIGHT_ORANGE, MIDDLE_BLUE,
    ORANGE, titled)
from bench.request import counted, halved, means, report_of, Subject
from bench.scoring import DEFAULT, STRICTEST
from fuzzy_stereo_ros.evaluation.baselines import dense, grey, TUNED
from fuzzy_stereo_ros.evaluation.ground_truth import KITTI
from fuzzy_stereo_ros.evaluation.matchers import Ours
from fuzzy_stereo_ros.evaluation.report import Table
from fuzzy_stereo_ros.evaluation.scores import score
import numpy as np
import pandas as pd

OURS, FAST, QUALITY = 'ours', 'ours, profile fast', 'ours, profile quality'
ON_GREY = ', grey'
OURS_GREY = OURS + ON_GREY
BASELINES = {one.name: one for one in (*DEFAULT, *TUNED, STRICTEST)}    # in the order of tables
NAMES = *(own + end for own in (OURS, FAST, QUALITY) for end in ('', ON_GREY)), *BASELINES
WITH_NOISE = OURS, OURS_GREY, FAST, QUALITY, '3WAY tuned', STRICTEST.name
FINE_LIMIT = 0.5
MUCH_WORSE = 1.5
FEWEST_NEARER = 100     # pixels beyond a range that is cut, of a scene that counts
SURE = 0.5, 0.8         # confidence from which they would be a surface
BESIDE = 'SGBM tuned', '3WAY tuned', 'HH4 tuned'
NOISES = 0, 1.5, 3      # grey levels, standard deviation
# At their defaults SGBM, 3WAY and HH4 differ too little to see in the picture.
BARS = {OURS: BLUE, OURS_GREY: MIDDLE_BLUE, QUALITY: LIGHT_BLUE, '3WAY tuned': LIGHT_ORANGE,
        STRICTEST.name: ORANGE, 'SGBM default': LIGHT_GREY, 'BM default': GREY}
BAR = 0.12          # width; 1 is the distance of two groups
LEAST = 7.5         # inches, width of the picture at the least


def run(request):
    """Return the `Report` of our matcher and OpenCV's on the scenes of a `Request`."""
    scenes, skipped = request.scenes()
    noised = [Subject(scene, f'noise {noise:g}', noise) for scene in scenes for noise in NOISES]
    figures, confidence, beyond = request.drawn(*(
        (items, title, partial(work, request.ours)) for items, title, work in (
            (noised, 'accuracy', measure), (scenes, 'confidence', worth),
            (scenes, 'range cut', nearer))))
    pairs, missing = ([], []) if request.quick else pairs_without_truth(
        request.data, request.only)
    kept = request.each(pairs, 'presets', lambda scene: kept_of(scene, request.ours))
    settings = {
        'ours': f'{request.ours.description}, filled, cold, images in colour where they are; the '
                'output as it comes',
        'grey': "ours on the same grey images as OpenCV's matchers, which take no others; "
                'two of the four KITTI pairs are grey anyway',
        'baselines': 'OpenCV on grey images, at the defaults of stereo_image_proc and tuned (left '
                     'border padded, settings as in evaluation/baselines.py, found by the '
                     'bench tuning on odd scenes); invalid pixels filled from the background '
                     'side on their row, then a 5x5 median',
        'error': 'percent of pixels off by more than 1 px (Middlebury, made; pixels that both '
                 'cameras see) or 3 px (KITTI; all with truth)',
        **in_words(request.draws),
        'tsukuba': 'every output is rounded first: its truth has whole pixels',
        'noise': 'normal, of so many grey levels, fresh in each pixel and channel, rounded and '
                 'clipped; the same pictures for all matchers: what is made grey of three '
                 'channels has two thirds of the noise',
        'Motorcycle': 'has no mask; counted are pixels whose match lies inside the right image '
                      'and is not covered by a surface nearer by more than 1 px',
    }
    return report_of('accuracy', 'Accuracy', settings, tables(figures, confidence, beyond, kept),
                     [*skipped, *missing], {'accuracy.svg': draw_accuracy})


def measure(ours, subject, draw):
    """
    Return a dict for each matcher on a draw of noise: group, scene, family, noise, matcher.

    bad, fine: percentage off by more than the limit of the scene, and by more than 0.5 px; whole:
    whether the truth has whole pixels. sparse: percentage of valid pixels that are wrong; density:
    percentage of valid pixels. Of ours also what `kept_and_wrong` returns, and `reliability`.
    """
    scene, _, noise = subject
    known, found = scene.read(), []
    pair, = with_draw([known], noise, draw, alike=False)
    images = pair.left, pair.right
    profiles = {OURS: ours, FAST: Ours(FAST, 'fast'), QUALITY: Ours(QUALITY, 'quality')}
    for name in WITH_NOISE if noise else NAMES:
        figures = {}
        if name in BASELINES:
            raw = BASELINES[name].matcher(scene.family, scene.disparities).match(*images)
            filled = dense(raw)
        else:
            match = profiles[name.removesuffix(ON_GREY)].matcher(scene.disparities).match(
                *(map(grey, images) if name.endswith(ON_GREY) else images))
            filled = match.disparity
            raw = np.where(match.confidence > 0, filled, np.nan)
            wrong, confidence = wrong_and_confidence(match, known, scene)
            figures = {**kept_and_wrong(confidence, wrong),
                       'reliability': reliability(wrong, confidence)}
        bad = score(known.as_scored(filled), known.truth, known.counts,
                    (scene.limit, FINE_LIMIT)).bad_dense
        sparse = score(known.as_scored(raw), known.truth, known.counts, (scene.limit,))
        found.append({
            'group': scene.group, 'scene': scene.path, 'family': scene.family, 'noise': noise,
            'matcher': name, 'bad': bad[scene.limit], 'fine': bad[FINE_LIMIT],
            'whole': known.whole_pixel, 'sparse': sparse.bad_sparse[scene.limit],
            'density': sparse.density, **figures})
    return found


def worth(ours, scene, draw):
    """
    Return a list of a dict: group, scene, and what confidence is worth, by headings.

    The left-right difference, of our own maps of both images, is compared with confidence.
    """
    known = scene.read()
    match, right = (ours.matcher(scene.disparities, reference=side).match(known.left, known.right)
                    for side in ('left', 'right'))
    counts = np.isfinite(known.truth) & (True if known.counts is None else known.counts)
    error = abs(known.as_scored(match.disparity) - known.truth)[counts]
    wrong = ~(error <= scene.limit)
    own, other, ideal = (sparsification(wrong, sureness) for sureness in (
        match.confidence[counts],
        left_right_sureness(match.disparity, right.disparity)[counts], -error))
    return [{'group': scene.group, 'scene': scene.path, 'area, confidence': own.area,
             'area, left-right difference': other.area, 'area, ideal': ideal.area,
             'wrong of all': own.at_100, 'of the surest 80 %': own.at_80,
             'by left-right difference': other.at_80}]


def nearer(ours, scene, draw):
    """
    Return a list of a dict of what becomes of the pixels nearer than the range cut by a quarter.

    In percent, by headings; an empty list where there are few. Pixels that only one camera sees
    count as well.
    """
    known, cut = scene.read(), scene.disparities * 3 // 4
    images = known.left, known.right
    valid = np.isfinite(known.truth)
    beyond = valid & (known.truth > cut - 0.5)
    if np.count_nonzero(beyond) < FEWEST_NEARER:
        return []
    figures = {'of all': 100 * np.count_nonzero(beyond) / np.count_nonzero(valid)}
    for name, own in ((OURS, ours), (QUALITY, Ours(QUALITY, 'quality'))):
        confidence = own.matcher(cut).match(*images).confidence[beyond]
        for least in SURE:
            figures[f'{name}, confidence {least:g}'] = 100 * float((confidence >= least).mean())
    for name in BESIDE:
        found = BASELINES[name].matcher(scene.family, cut).match(*images)[beyond]
        figures[f'{name}, valid'] = 100 * float(np.isfinite(found).mean())
    return [{'group': scene.group, 'scene': scene.path, **figures}]


def tables(figures, confidence, beyond, kept=()):
    """Return the tables of DataFrames of `measure`, `worth`, `nearer`; kept: see `kept_of`."""
    tuned = [name for name in NAMES if 'tuned' in name]
    clean = figures[figures.noise == 0]
    fine = clean[~clean.whole & (clean.family != KITTI)]
    scenes = clean.pivot_table('bad', 'scene', 'matcher', sort=False).reindex(columns=NAMES)
    noised = means_over_draws(figures[figures.noise == NOISES[1]], ['scene', 'matcher'], ['bad'])
    halves = halved(clean, 'matcher')
    some = [(name, half) for name in (OURS, OURS_GREY, QUALITY, *tuned[-3:])
            for half in ('odd', 'even')]
    halves = halves.pivot_table('bad', 'group', ['matcher', 'half'], sort=False)
    return [
        Table.of('Groups, mean error in percent', means(clean, 'bad', NAMES),
                 '*0 rejected*: a disparity of 0 is filled as well, which helps where nothing is '
                 'infinitely far.'),
        Table.of('Odd and even scenes of each group, mean error in percent',
                 halves.reindex(columns=some).dropna(how='all').set_axis(
                     map(', '.join, some), axis=1)),
        Table.of('Off by more than 0.5 px, scenes with sub-pixel truth, percent',
                 means(fine, 'fine', NAMES)),
        *(Table.of(title, means(figures, figure, WITH_NOISE, worst=worst), note)
          for title, figure, worst, note in (
              ('Noise: mean error in percent, dense', 'bad', 'max', ''),
              ('Noise: percent wrong of the valid pixels', 'sparse', 'max',
               'Ours: valid are pixels of a confidence above 0; baselines: those that they do not '
               'reject.'),
              ('Noise: percent of the pixels that are valid', 'density', 'min', ''))),
        *_confidence(confidence, figures),
        *([table_without_truth(kept)] if kept else []),
        *([Table.of(
            'Range cut by a quarter: percent of the nearer pixels that become a surface',
            counted(beyond).groupby('group', sort=False).mean(numeric_only=True).drop(
                columns='draw'),
            'Of the pixels with truth that are nearer than the range, *of all* the pixels; what '
            'they get is too far away. OpenCV has no confidence: valid is what it gives out.')]
          if len(beyond) else []),
        Table.of('Scenes, error in percent', scenes, _much_worse(scenes, tuned)),
        Table.of(f'Scenes, noise {NOISES[1]:g}: error in percent',
                 noised.bad.unstack('matcher', sort=False)),
    ]


def _confidence(confidence, figures):
    """Return the tables of our confidence and of the presets of its threshold."""
    worth = counted(confidence).groupby('group', sort=False).mean(numeric_only=True)
    worth['ratio of areas'] = worth['area, confidence'] / worth['area, left-right difference']
    worth['ratio of shares'] = worth['of the surest 80 %'] / worth['wrong of all']
    made = [Table.of(
        'Confidence: percent wrong when the least sure pixels are dropped first',
        worth[['area, confidence', 'area, left-right difference', 'ratio of areas', 'area, ideal',
               'wrong of all', 'of the surest 80 %', 'ratio of shares',
               'by left-right difference']],
        'Area under the sparsification curve, in percent: the mean share of wrong pixels among '
        'those kept. The left-right difference is that of our own maps of the two images.')]
    for name in (OURS, QUALITY):
        rows = []
        for (group, draw), several in counted(figures[figures.matcher == name]).groupby(
                ['group', 'draw'], sort=False):
            number, right = sum(several.reliability)
            rows.append({'group': group, 'draw': draw, **dict(zip(
                CONFIDENCES, 100 * right / np.where(number, number, np.nan)))})
        made.append(Table.of(
            f'Confidence: percent of pixels that are right, by what it says, {name}',
            means_over_draws(pd.DataFrame(rows), ['group'], CONFIDENCES, 'min'),
            'Of all valid pixels with truth, also of those that one camera sees.'))
    return [*made, table_with_truth(counted(figures[figures.matcher == OURS]))]


def _much_worse(scenes, tuned):
    """Return a sentence about the scenes where the best tuned baseline is far better."""
    best, who = scenes[tuned].min(axis=1), scenes[tuned].idxmin(axis=1)
    found = [f'{scene} ({scenes[OURS][scene]:.2f} against {best[scene]:.2f}, {who[scene]})'
             for scene in scenes.index[scenes[OURS] > MUCH_WORSE * best]]
    return ('More than 1.5 times worse than the best tuned baseline: '
            + (', '.join(found) if found else 'on no scene') + '.')


def draw_accuracy(tables):
    """Return the Figure of the table of groups: error bars of ours and OpenCV's matchers."""
    table = titled(tables, 'Groups')
    groups = [row[0] for row in table.rows]
    figure = figure_of(max(LEAST, 1.85 * len(groups)), 4.0)
    panel = figure.subplots()
    for place, (name, colour) in enumerate(BARS.items()):
        errors = column(table, name)
        known = [number for number, group in enumerate(groups) if errors[group] is not None]
        bars = panel.bar([number + (place - (len(BARS) - 1) / 2) * BAR for number in known],
                         [errors[groups[number]] for number in known], BAR, color=colour,
                         label=name if name.startswith('ours') else f'OpenCV {name}')
        panel.bar_label(bars, fmt='%.1f', fontsize=6.5, padding=1)
    panel.set_xticks(range(len(groups)), [group.replace(' (', '\n(') for group in groups])
    panel.set_xlim(-0.6, len(groups) - 0.4)
    panel.tick_params(axis='x', length=0)
    panel.set_ylabel('pixels off by more than 1 px (KITTI: 3 px) [%]')
    panel.grid(axis='y', alpha=0.3)
    panel.set_title('Error by group of scenes, lower is better', loc='left')
    add_legend(figure)
    return figure
