# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Accuracy: dense errors on every scene with one setting, side by side with OpenCV's matchers.

Middlebury scenes are scored by bad-1 over the pixels that both cameras see, KITTI by bad-3 over
all pixels with truth. Everything is repeated with camera noise, on the same images for all
matchers. What the confidence of ours is worth is measured on the same maps.
"""
from functools import partial

from bench.confidence import (
    CONFIDENCES, kept_and_wrong, kept_of, pairs_without_truth, reliability, table_with_truth,
    wrong_and_confidence)
from bench.draws import in_words, means_over_draws, with_draw
from bench.page import add_legend, BLUE, column, figure_of, LIGHT_BLUE, MIDDLE_BLUE, ORANGE, titled
from bench.request import counted, means, report_of, Subject
from bench.scoring import STRICTEST
from fuzzy_stereo_ros.evaluation.baselines import dense, TUNED
from fuzzy_stereo_ros.evaluation.matchers import Ours
from fuzzy_stereo_ros.evaluation.report import Table
from fuzzy_stereo_ros.evaluation.scores import score
from fuzzy_stereo_ros.matching.row_offsets import grey
import numpy as np
import pandas as pd

OURS, ON_GREY, FAST, QUALITY = 'ours', 'ours, grey', 'ours, profile fast', 'ours, profile quality'
REALTIME = 'ours, profile realtime'
BEST = 'best tuned OpenCV'
BASELINES = {one.name: one for one in (*TUNED, STRICTEST)}
FINE_LIMIT = 0.5
NOISES = 0, 1.5         # grey levels, standard deviation
BARS = {OURS: BLUE, ON_GREY: MIDDLE_BLUE, QUALITY: LIGHT_BLUE, BEST: ORANGE}
BAR = 0.2           # width; 1 is the distance of two groups
LEAST = 7.5         # inches, width of the picture at the least


def run(request):
    """Return the `Report` of our matcher and OpenCV's on the scenes of a `Request`."""
    scenes, skipped = request.scenes()
    figures, = request.drawn((
        [Subject(scene, f'noise {noise:g}', noise) for scene in scenes for noise in NOISES],
        'accuracy', partial(measure, request.ours)))
    pairs, missing = ([], []) if request.quick else pairs_without_truth(
        request.data, request.only)
    kept = request.each(pairs, 'presets', lambda scene: kept_of(scene, request.ours))
    settings = {
        'ours': f'{request.ours.description}, filled, cold, images in colour where they are; the '
                "output as it comes; grey: on the same grey images as OpenCV's matchers, which "
                'take no others; two of the four KITTI pairs are grey anyway',
        'OpenCV': 'the least of the mean errors of BM, SGBM, 3WAY and HH4 on grey images: left '
                  'border padded, settings as in evaluation/baselines.py, found by the bench '
                  'tuning on odd scenes; HH4 also with disparities of 0 filled; invalid pixels '
                  'filled from the background side on their row, then a 5x5 median',
        'error': 'percent of pixels off by more than 1 px (Middlebury, made; pixels that both '
                 'cameras see) or 3 px (KITTI; all with truth); of tsukuba, whose truth has '
                 'whole pixels, every output is rounded first; of Motorcycle, which has no mask, '
                 'pixels count whose match lies inside the right image and is not covered by a '
                 'surface nearer by more than 1 px',
        **in_words(request.draws),
        'noise': 'normal, of so many grey levels, fresh in each pixel and channel, rounded and '
                 'clipped; what is made grey of three channels has two thirds of the noise',
    }
    return report_of('accuracy', 'Accuracy', settings, tables(figures), [
        *skipped, *missing], {'accuracy.svg': draw_accuracy}, scenes=figures,
        without_truth=pd.DataFrame(kept))


def measure(ours, subject, draw):
    """
    Return a dict for each matcher on a draw of noise: group, scene, noise, matcher.

    error, fine: percentage off by more than the limit of the scene, and by more than 0.5 px;
    sparse: percentage of valid pixels that are wrong; density: percentage of valid pixels. Of ours
    also what `kept_and_wrong` returns, and the numbers of all and of correct pixels by confidence.
    """
    scene, _, noise = subject
    known, found = scene.read(), []
    pair, = with_draw([known], noise, draw, alike=False)
    images = pair.left, pair.right
    profiles = {OURS: ours, ON_GREY: ours, FAST: Ours(FAST, 'fast'),
                QUALITY: Ours(QUALITY, 'quality')}
    for name in (*profiles, *BASELINES):
        figures = {}
        if name in BASELINES:
            raw = BASELINES[name].matcher(scene.family, scene.disparities).match(*images)
            filled = dense(raw)
        else:
            match = profiles[name].matcher(scene.disparities).match(
                *(map(grey, images) if name == ON_GREY else images))
            filled = match.disparity
            raw = np.where(match.confidence > 0, filled, np.nan)
            wrong, confidence = wrong_and_confidence(match, known, scene)
            figures = kept_and_wrong(confidence, wrong)
            for words, number, right in zip(CONFIDENCES, *reliability(wrong, confidence)):
                figures.update({f'{words}, all': number, f'{words}, right': right})
        bad = score(known.as_scored(filled), known.truth, known.counts,
                    (scene.limit, FINE_LIMIT)).bad_dense
        sparse = score(known.as_scored(raw), known.truth, known.counts, (scene.limit,))
        found.append({
            'group': scene.group, 'scene': scene.path, 'noise': noise, 'matcher': name,
            'error': bad[scene.limit], 'fine': bad[FINE_LIMIT],
            'sparse': sparse.bad_sparse[scene.limit], 'density': sparse.density, **figures})
    return found


def tables(figures):
    """Return the tables of a DataFrame of figures of `measure`."""
    of_groups = means(figures, figures.matcher.unique())
    of_groups[BEST] = of_groups[[*BASELINES]].apply(lambda row: min(row, key=float), axis=1)
    of_ours = counted(figures[(figures.matcher == OURS) & (figures.noise == NOISES[1])])
    return [
        Table.of('Groups: mean error in percent', of_groups.drop(columns=[*BASELINES])),
        density_table(figures), confidence_table(of_ours), table_with_truth(of_ours, NOISES[1])]


def density_table(figures):
    """Return the table of errors and of valid pixels of all matchers on the first group."""
    first = figures.group.iloc[0]
    shown = figures.matcher.isin((OURS, FAST, QUALITY, *BASELINES))
    found = figures[shown & (figures.group == first) & (figures.noise == NOISES[0])].groupby(
        'matcher', sort=False)[['error', 'sparse', 'density']].mean().rename({OURS: REALTIME})
    return Table.of(f'Valid pixels: percent, {first} without noise', found.set_axis(
        ['error, filled', 'error of the valid', 'valid'], axis='columns'))


def confidence_table(of_ours):
    """Return the table of the share of correct pixels by confidence."""
    sums = of_ours.groupby(['group', 'draw'], sort=False).sum(numeric_only=True)
    shares = pd.DataFrame({
        words: 100 * sums[f'{words}, right'] / sums[f'{words}, all'].where(
            sums[f'{words}, all'] > 0) for words in CONFIDENCES}).reset_index()
    return Table.of(f'Confidence: percent of pixels that are right, noise {NOISES[1]:g}',
                    means_over_draws(shares, ['group'], CONFIDENCES, 'min'),
                    'Columns: what confidence says. Of all valid pixels with truth, also of those '
                    'that one camera sees.')


def draw_accuracy(tables):
    """Return the Figure of the table of groups: error bars of ours and of OpenCV's best."""
    table = titled(tables, 'Groups')
    groups = [row[0] for row in table.rows if not row[0].endswith(f'noise {NOISES[1]:g}')]
    figure = figure_of(max(LEAST, 1.5 * len(groups)), 4.0)
    panel = figure.subplots()
    for place, (name, colour) in enumerate(BARS.items()):
        errors = column(table, name)
        bars = panel.bar([number + (place - (len(BARS) - 1) / 2) * BAR
                          for number in range(len(groups))],
                         [errors[group] for group in groups], BAR, color=colour, label=name)
        panel.bar_label(bars, fmt='%.1f', fontsize=6.5, padding=1)
    panel.set_xticks(range(len(groups)), [
        group.removesuffix(', noise 0').replace(' (', '\n(') for group in groups])
    panel.set_xlim(-0.6, len(groups) - 0.4)
    panel.tick_params(axis='x', length=0)
    panel.set_ylabel('pixels off by more than 1 px (KITTI: 3 px) [%]')
    panel.grid(axis='y', alpha=0.3)
    panel.set_title('Error by group of scenes, lower is better', loc='left')
    add_legend(figure, len(BARS))
    return figure
