# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Accuracy: dense errors on every scene with one setting, side by side with OpenCV's matchers.

Middlebury scenes are scored by bad-1 over the pixels that both cameras see, KITTI by bad-3 over
all pixels with truth. Means of odd and of even scenes allow to check on one half the settings
chosen on the other. Everything is repeated with camera noise, on the same images for all matchers.
"""
from dataclasses import replace
from typing import NamedTuple

from bench.confidence import (
    CONFIDENCES, kept_and_wrong, kept_of, left_right_sureness, pairs_without_truth, reliability,
    sparsification, table_with_truth, table_without_truth, wrong_and_confidence)
from bench.page import (
    add_legend, BLUE, column, figure_of, GREY, LIGHT_BLUE, LIGHT_GREY, LIGHT_ORANGE, MIDDLE_BLUE,
    ORANGE, titled)
from bench.request import counted, halved, means, report_of
from bench.scoring import DEFAULT, STRICTEST
from fuzzy_stereo_ros.evaluation.baselines import dense, grey, TUNED
from fuzzy_stereo_ros.evaluation.ground_truth import KITTI
from fuzzy_stereo_ros.evaluation.matchers import Ours
from fuzzy_stereo_ros.evaluation.report import Table
from fuzzy_stereo_ros.evaluation.scores import score
import numpy as np
import pandas as pd

OURS, FAST, QUALITY = 'ours', 'ours, profile fast', 'ours, profile quality'
OURS_GREY, FAST_GREY, QUALITY_GREY = (f'{name}, grey' for name in (OURS, FAST, QUALITY))
BASELINES = *DEFAULT, *TUNED, STRICTEST     # in the order of the tables
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


class Measured(NamedTuple):
    """
    Four lists of dicts, one for each table of figures; each dict names group and scene.

    figures: of each noise and matcher: percentage off by more than the limit of the scene (`bad`)
    and by more than 0.5 px (`fine`); whether the truth has whole pixels (`whole`); percentage of
    valid pixels that are wrong (`sparse`); percentage of valid pixels (`density`). reliable: of
    each noise, profile and range of confidence: `number` of pixels with truth, and the number of
    correct ones, `right`. confidence: of each scene, by the headings of its tables, and the time
    of profile quality. nearer: by headings, what becomes of the pixels that are nearer than a
    range cut by a quarter; empty where there are few.
    """

    figures: list
    reliable: list
    confidence: list
    nearer: list


def run(request):
    """Return the `Report` of our matcher and OpenCV's on the scenes of a `Request`."""
    scenes, skipped = request.scenes()
    several = request.each(scenes, 'accuracy', lambda scene: measure(scene, request))
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
        'tsukuba': 'every output is rounded first: its truth has whole pixels',
        'noise': 'normal, of so many grey levels, fresh in each pixel and channel, rounded and '
                 'clipped; the same pictures for all matchers: what is made grey of three '
                 'channels has two thirds of the noise',
        'Motorcycle': 'has no mask; counted are pixels whose match lies inside the right image '
                      'and is not covered by a surface nearer by more than 1 px',
    }
    return report_of('accuracy', 'Accuracy', settings, tables(several, kept),
                     [*skipped, *missing], {'accuracy.svg': draw_accuracy})


def measure(scene, request):
    """Return the `Measured` of one scene."""
    known, found = scene.read(), Measured([], [], [], [])
    named = {'group': scene.group, 'scene': scene.path, 'family': scene.family}
    for noise in NOISES:
        matches, maps = matched(scene, with_camera_noise(known, noise), request)
        found.figures.extend({**named, 'noise': noise, 'matcher': name,
                              **_figures(known, scene.limit, *two)} for name, two in maps.items())
        for name, match in matches.items():
            found.reliable.extend(
                {**named, 'noise': noise, 'matcher': name, 'confidence': confidence,
                 'number': number, 'right': right} for confidence, number, right in zip(
                     CONFIDENCES, *reliability(*wrong_and_confidence(match, known, scene))))
        if not noise:
            right = request.ours.matcher(scene.disparities, reference='right').match(
                known.left, known.right)
            found.confidence.append({
                **named, 'seconds of quality': matches[QUALITY].times['total'] / 1000,
                **_worth(known, scene, matches[OURS], right)})
            found.nearer.extend({**named, **figures} for figures in _nearer(known, scene, request))
    return found


def _figures(known, limit, filled, found):
    """Return the figures of a map, filled and with gaps, by the names of `Measured`."""
    limits = limit, FINE_LIMIT
    bad = score(known.as_scored(filled), known.truth, known.counts, limits).bad_dense
    sparse = score(known.as_scored(found), known.truth, known.counts, limits)
    return {'bad': bad[limit], 'fine': bad[FINE_LIMIT], 'whole': known.whole_pixel,
            'sparse': sparse.bad_sparse[limit], 'density': sparse.density}


def _worth(known, scene, match, right):
    """
    Return the figures of the confidence of a match, by the headings of tables.

    right: the match of the right image; the left-right difference is compared with confidence.
    """
    counts = np.isfinite(known.truth) & (True if known.counts is None else known.counts)
    error = abs(known.as_scored(match.disparity) - known.truth)[counts]
    wrong = ~(error <= scene.limit)
    own, other, ideal = (sparsification(wrong, sureness) for sureness in (
        match.confidence[counts],
        left_right_sureness(match.disparity, right.disparity)[counts], -error))
    figures = {'area, confidence': own.area, 'area, left-right difference': other.area,
               'area, ideal': ideal.area, 'wrong of all': own.at_100,
               'of the surest 80 %': own.at_80, 'by left-right difference': other.at_80}
    wrong, confidence = wrong_and_confidence(match, known, scene)
    return {**figures, **kept_and_wrong(confidence, wrong)}


def _nearer(known, scene, request):
    """
    Yield what becomes of the pixels that are nearer than the range cut by a quarter, in percent.

    Pixels that only one camera sees count as well.
    """
    cut, images = scene.disparities * 3 // 4, (known.left, known.right)
    nearer = np.isfinite(known.truth) & (known.truth > cut - 0.5)
    if np.count_nonzero(nearer) < FEWEST_NEARER:
        return
    figures = {'of all': 100 * np.count_nonzero(nearer) / np.count_nonzero(
        np.isfinite(known.truth))}
    for name, ours in ((OURS, request.ours), (QUALITY, Ours(QUALITY, 'quality'))):
        confidence = ours.matcher(cut).match(*images).confidence[nearer]
        for least in SURE:
            figures[f'{name}, confidence {least:g}'] = 100 * float((confidence >= least).mean())
    for baseline in BASELINES:
        if baseline.name in BESIDE:
            found = baseline.matcher(scene.family, cut).match(*images)[nearer]
            figures[f'{baseline.name}, valid'] = 100 * float(np.isfinite(found).mean())
    yield figures


def with_camera_noise(known, sigma):
    """
    Return a `GroundTruthPair` with noise, independent in each pixel and channel.

    sigma: grey levels, standard deviation. A pair always gets the same noise.
    """
    if not sigma:
        return known
    random = np.random.default_rng(0)
    left, right = (
        np.clip(np.rint(image + sigma * random.standard_normal(image.shape)), 0, 255).astype(
            np.uint8) for image in (known.left, known.right))
    return replace(known, left=left, right=right)


def matched(scene, known, request):
    """Return {ours, in colour and grey: Match}, and {matcher: (filled map, map with gaps)}."""
    images = known.left, known.right
    greys, matches = [grey(image) for image in images], {}
    for name, grey_name, ours in ((OURS, OURS_GREY, request.ours),
                                  (FAST, FAST_GREY, Ours(FAST, 'fast')),
                                  (QUALITY, QUALITY_GREY, Ours(QUALITY, 'quality'))):
        matches[name], matches[grey_name] = (
            ours.matcher(scene.disparities).match(*those) for those in (images, greys))
    maps = {name: (match.disparity, np.where(match.confidence > 0, match.disparity, np.nan))
            for name, match in matches.items()}
    for baseline in BASELINES:
        found = baseline.matcher(scene.family, scene.disparities).match(*images)
        maps[baseline.name] = dense(found), found
    return matches, maps


def tables(several, kept=()):
    """Return the tables of a list of `Measured`, one for each scene; kept: see `kept_of`."""
    figures, reliable, confidence, nearer = (
        pd.DataFrame([row for part in parts for row in part]) for parts in zip(*several))
    names = [OURS, OURS_GREY, FAST, FAST_GREY, QUALITY, QUALITY_GREY, *(
        baseline.name for baseline in BASELINES)]
    tuned = [name for name in names if 'tuned' in name]
    clean = figures[figures.noise == 0]
    fine = clean[~clean.whole & (clean.family != KITTI)]
    scenes = clean.pivot_table('bad', 'scene', 'matcher', sort=False).reindex(columns=names)
    halves = halved(clean, 'matcher')
    some = [(name, half) for name in (OURS, OURS_GREY, QUALITY, *tuned[-3:])
            for half in ('odd', 'even')]
    halves = halves.pivot_table('bad', 'group', ['matcher', 'half'], sort=False)
    return [
        Table.of('Groups, mean error in percent', means(clean, 'bad', names),
                 '*0 rejected*: a disparity of 0 is filled as well, which helps where nothing is '
                 'infinitely far.'),
        Table.of('Odd and even scenes of each group, mean error in percent',
                 halves.reindex(columns=some).dropna(how='all').set_axis(
                     map(', '.join, some), axis=1)),
        Table.of('Off by more than 0.5 px, scenes with sub-pixel truth, percent',
                 means(fine, 'fine', names)),
        *(Table.of(title, means(figures, figure, [
            name for name in names if 'default' not in name]), note)
          for title, figure, note in (
              ('Noise: mean error in percent, dense', 'bad', ''),
              ('Noise: percent wrong of the valid pixels', 'sparse',
               'Ours: valid are pixels of a confidence above 0; baselines: those that they do not '
               'reject.'),
              ('Noise: percent of the pixels that are valid', 'density', ''))),
        *_confidence(confidence, reliable),
        *([table_without_truth(kept)] if kept else []),
        *([Table.of(
            'Range cut by a quarter: percent of the nearer pixels that become a surface',
            counted(nearer).groupby('group', sort=False).mean(numeric_only=True),
            'Of the pixels with truth that are nearer than the range, *of all* the pixels; what '
            'they get is too far away. OpenCV has no confidence: valid is what it gives out.')]
          if len(nearer) else []),
        Table.of('Scenes, error in percent',
                 scenes.join(confidence.set_index('scene')['seconds of quality']),
                 _much_worse(scenes, tuned)),
    ]


def _confidence(confidence, reliable):
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
        sums = counted(reliable[reliable.matcher == name]).groupby(
            ['group', 'confidence'], sort=False)[['number', 'right']].sum()
        share = (100 * sums.right / sums.number.where(sums.number > 0)).unstack()
        made.append(Table.of(
            f'Confidence: percent of pixels that are right, by what it says, {name}',
            share[CONFIDENCES].loc[list(dict.fromkeys(sums.index.get_level_values(0)))],
            'Of all valid pixels with truth, also of those that one camera sees.'))
    return [*made, table_with_truth(worth)]


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
