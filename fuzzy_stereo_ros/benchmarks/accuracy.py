# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Accuracy: every scene, dense, one setting, side by side with OpenCV's matchers.

Middlebury scenes are scored by bad-1 over the pixels that both cameras see, KITTI by bad-3 over
all pixels with truth. Scenes are cut into odd and even ones, so that settings chosen on one half
can be checked on the other. All is repeated with the noise that a camera has, for all contestants
on the same pictures.
"""
from dataclasses import dataclass, replace
from functools import partial

from fuzzy_stereo_ros.benchmarks.confidence import (
    BINS, left_right_sureness, reliability, sparsification)
from fuzzy_stereo_ros.benchmarks.pictures import as_svg, draw_accuracy
from fuzzy_stereo_ros.benchmarks.request import grouped
from fuzzy_stereo_ros.evaluation.baselines import (
    default_baselines, dense, opencv_threads, strictest_baseline, tuned_baselines)
from fuzzy_stereo_ros.evaluation.datasets import Scene
from fuzzy_stereo_ros.evaluation.ground_truth import bad_percent, KITTI, MIDDLEBURY
from fuzzy_stereo_ros.evaluation.report import environment, Report, Table
from fuzzy_stereo_ros.evaluation.scores import score
import numpy as np

OURS, QUALITY = 'ours', 'ours, profile quality'
FINE_LIMIT = 0.5
MUCH_WORSE = 1.5
NOISES = 0, 1.5, 3      # grey levels, standard deviation
# The confidence_threshold of config/<name>.yaml.
PRESETS = {'costmap': 0.95, 'mapping': 0.8, 'inspection': 0.5}


@dataclass(frozen=True)
class Result:
    """
    What was found on one scene.

    bad, fine: {contestant: percent} off by more than the scene's limit, and by more than 0.5 px.
    raw_bad, raw_fine: the same without rounding, where the truth has whole pixels; else None.
    own, other, ideal: `Sparsification` by our confidence, by the difference of left and right
    map, and by the error itself. quality_seconds: what the profile `quality` took.
    noisy: {noise: {contestant: (dense, sparse, density)}}, percent wrong of all pixels, percent
    wrong of those that are valid, and how many percent those are. reliable: {noise: {ours: of
    `reliability`}}, of all pixels with truth. kept: {preset: (percent kept, percent wrong of
    these)}, of the same.
    """

    scene: Scene
    bad: dict
    fine: dict
    raw_bad: dict | None
    raw_fine: dict | None
    own: tuple
    other: tuple
    ideal: tuple
    quality_seconds: float
    noisy: dict
    reliable: dict
    kept: dict


def run(request):
    """Return the `Report` of our matcher and OpenCV's on the scenes of a request."""
    scenes, skipped = request.scenes()
    with opencv_threads(1):
        results = [measure(scene, request) for scene in request.follow(scenes, 'accuracy')]
    settings = {
        **environment('one each'),
        'ours': f'{request.subject}, filled, cold, colour images; the output as it comes',
        'rivals': 'OpenCV on grey images, at the defaults of stereo_image_proc and tuned (left '
                  'border padded, settings as in evaluation/baselines.py); invalid '
                  'pixels filled from the background side on their row, then a 5x5 median',
        'error': 'percent of pixels off by more than 1 px (Middlebury, made; pixels that both '
                 'cameras see) or 3 px (KITTI; all with truth)',
        'tsukuba': 'every output is rounded first: its truth has whole pixels',
        'noise': 'normal, of so many grey levels, fresh in each pixel and channel, rounded and '
                 'clipped; the same pictures for all contestants',
        'Motorcycle': 'has no mask; counted are pixels whose match lies inside the right image '
                      'and is not covered by a surface nearer by more than 1 px',
    }
    found = tables(results)
    pictures, missing = as_svg('accuracy.svg', partial(draw_accuracy, found))
    return Report('accuracy', 'Accuracy', settings, found, [*skipped, *missing], pictures)


def measure(scene, request):
    """Return the `Result` of one scene."""
    known = scene.read()
    noisy = {noise: matched(scene, with_camera_noise(known, noise), request) for noise in NOISES}
    matches, maps = noisy[0]
    match, quality = matches[OURS], matches[QUALITY]
    maps = {name: filled for name, (filled, _) in maps.items()}
    right = request.matcher(scene.disparities, reference='right').match(known.left, known.right)

    def figures(pair, limit):
        return {name: bad_percent(found, pair, limit) for name, found in maps.items()}

    counts = np.isfinite(known.truth) & (True if known.counts is None else known.counts)
    shown = np.rint(match.disparity) if known.whole_pixel else match.disparity
    error = abs(shown - known.truth)[counts]
    wrong = ~(error <= scene.limit)
    sureness = left_right_sureness(match.disparity, right.disparity)
    unrounded = replace(known, whole_pixel=False)
    return Result(
        scene, figures(known, scene.limit), figures(known, FINE_LIMIT),
        figures(unrounded, scene.limit) if known.whole_pixel else None,
        figures(unrounded, FINE_LIMIT) if known.whole_pixel else None,
        sparsification(wrong, match.confidence[counts]),
        sparsification(wrong, sureness[counts]), sparsification(wrong, -error),
        quality.times['total'] / 1000,
        {noise: {name: (bad_percent(filled, known, scene.limit), *_sparse(found, known, scene))
                 for name, (filled, found) in found_maps.items()}
         for noise, (_, found_maps) in noisy.items()},
        {noise: {name: reliability(*_judged(found, known, scene))
                 for name, found in found_matches.items()}
         for noise, (found_matches, _) in noisy.items()},
        {preset: _kept(threshold, *_judged(match, known, scene))
         for preset, threshold in PRESETS.items()})


def _judged(match, known, scene):
    """Return which pixels with truth are wrong, hidden ones too, and their confidence."""
    told = np.isfinite(known.truth)
    error = abs(known.as_scored(match.disparity) - known.truth)[told]
    return ~(error <= scene.limit), match.confidence[told]


def _kept(threshold, wrong, confidence):
    """Return the percent of the pixels that a threshold keeps, and the percent wrong of these."""
    kept = confidence >= threshold
    return 100 * float(kept.mean()), 100 * float(wrong[kept].mean()) if kept.any() else None


def with_camera_noise(known, sigma):
    """
    Return a `GroundTruthPair` with noise, fresh in each pixel and channel, rounded and clipped.

    sigma: grey levels, standard deviation; the same noise whenever a pair is asked for.
    """
    if not sigma:
        return known
    chance = np.random.default_rng(0)
    left, right = (
        np.clip(np.rint(image + sigma * chance.standard_normal(image.shape)), 0, 255).astype(
            np.uint8) for image in (known.left, known.right))
    return replace(known, left=left, right=right)


def matched(scene, known, request):
    """Return {ours: match}, and {contestant: (map without gaps, map with them)}."""
    images = known.left, known.right
    matches = {OURS: request.matcher(scene.disparities).match(*images),
               QUALITY: replace(request, profile='quality', changes={}).matcher(
                   scene.disparities).match(*images)}
    maps = {name: (match.disparity, np.where(match.confidence > 0, match.disparity, np.nan))
            for name, match in matches.items()}
    for rival in (*default_baselines(), *tuned_baselines(scene.family),
                  strictest_baseline(scene.family)):
        found = rival.match(*images, scene.disparities)
        maps[rival.name] = dense(found), found
    return matches, maps


def _sparse(found, known, scene):
    """Return the percent wrong of the pixels that are valid, and the percent valid."""
    figures = score(known.as_scored(found), known.truth, known.counts, (scene.limit,))
    return figures.bad_sparse[scene.limit], figures.density


def tables(results):
    """Return the tables of a list of `Result`s."""
    contestants = (OURS, QUALITY, *(rival.name for rival in (
        *default_baselines(), *tuned_baselines(MIDDLEBURY), strictest_baseline(MIDDLEBURY))))
    tuned = tuple(name for name in contestants if 'tuned' in name)
    groups = grouped(results)
    columns = ('', *contestants)
    fine = {group: [result for result in found if result.raw_fine is None]
            for group, found in groups.items()}
    fine = {group: found for group, found in fine.items()
            if found and found[0].scene.family != KITTI}
    whole = [result for result in results if result.raw_bad is not None]
    made = [
        Table('Groups, mean error in percent', columns,
              [(_title(group, found), *_means(found, 'bad', contestants))
               for group, found in groups.items()],
              '*0 refused*: a disparity of 0 is filled as well, which helps where nothing is '
              'infinitely far.'),
        Table('Odd and even scenes of each group, mean error in percent',
              ('', *(f'{name}, {half}' for name in (OURS, QUALITY, *tuned[-3:])
                     for half in ('odd', 'even'))),
              [(group, *(_mean(part, 'bad', name) for name in (OURS, QUALITY, *tuned[-3:])
                         for part in (found[::2], found[1::2])))
               for group, found in groups.items() if len(found) > 1]),
        Table('Off by more than 0.5 px, scenes with sub-pixel truth, percent', columns,
              [(_title(group, found), *_means(found, 'fine', contestants))
               for group, found in fine.items()]),
        *_noise_tables(groups, contestants),
        _confidence(groups),
        *_reliability_tables(groups),
        _presets(groups),
        Table('Scenes, error in percent', (*columns, 'seconds of quality'),
              [(result.scene.path, *(result.bad.get(name) for name in contestants),
                result.quality_seconds) for result in results], _much_worse(results, tuned)),
    ]
    if whole:
        made.insert(3, Table(
            'Whole-pixel truth: rounded and as it comes, percent', columns,
            [(f'{result.scene.name}, off by more than {limit} px, {how}',
              *(getattr(result, name).get(rival) for rival in contestants))
             for result in whole
             for limit, how, name in ((1, 'rounded', 'bad'), (1, 'as it comes', 'raw_bad'),
                                      (0.5, 'rounded', 'fine'), (0.5, 'as it comes', 'raw_fine'))]
        ))
    return made


def _noise_tables(groups, contestants):
    """Return the tables of what noise does to each contestant."""
    shown = tuple(name for name in contestants if 'default' not in name)
    titles = {
        'Noise: mean error in percent, dense': None,
        'Noise: percent wrong of the valid pixels':
            'Ours: valid are pixels of a confidence above 0; rivals: those that they do not '
            'refuse.',
        'Noise: percent of the pixels that are valid': None}
    return [Table(title, ('', *shown), [
        (f'{_title(group, found)}, noise {noise}',
         *(_mean_of([result.noisy[noise].get(name, (None,) * 3)[place] for result in found])
           for name in shown))
        for group, found in groups.items() for noise in NOISES], note)
        for place, (title, note) in enumerate(titles.items())]


def _confidence(groups):
    """Return the table that tells what our confidence is worth."""
    rows = []
    for group, found in groups.items():
        own, other, ideal = (np.mean([getattr(result, name) for result in found], axis=0)
                             for name in ('own', 'other', 'ideal'))
        rows.append((_title(group, found), *map(float, (
            own[0], other[0], own[0] / other[0] if other[0] else np.nan, ideal[0], own[2],
            own[1], own[1] / own[2] if own[2] else np.nan, other[1]))))
    return Table(
        'Confidence: percent wrong when the least sure pixels are dropped first',
        ('', 'area, confidence', 'area, left-right difference', 'ratio of areas', 'area, ideal',
         'wrong of all', 'of the surest 80 %', 'ratio of shares', 'by left-right difference'),
        rows,
        'Area under the sparsification curve, in percent: the mean share of wrong pixels among '
        'those kept. The left-right difference is that of our own maps of the two images.')


def _reliability_tables(groups):
    """Return the tables of how many pixels of each confidence are right."""
    edges = [f'{low:g} to {high:g}' for low, high in zip(BINS, BINS[1:])]
    made = []
    for name in (OURS, QUALITY):
        rows = []
        for group, found in groups.items():
            for noise in NOISES:
                number, right = np.sum([result.reliable[noise][name] for result in found], axis=0)
                rows.append((f'{_title(group, found)}, noise {noise}', *(
                    float(100 * good / many) if many else None
                    for many, good in zip(number, right))))
        made.append(Table(
            f'Confidence: percent of pixels that are right, by what it says, {name}',
            ('', *edges), rows,
            'Of all valid pixels with truth, also of those that one camera sees.'))
    return made


def _presets(groups):
    """Return the table of what the presets of config/ keep, and of what they get wrong."""
    rows = [(_title(group, found), *(
        _mean_of([result.kept[preset][place] for result in found])
        for preset in PRESETS for place in (0, 1))) for group, found in groups.items()]
    return Table(
        'Presets of confidence_threshold: percent of the pixels kept, and wrong of these',
        ('', *(f'{preset} ({threshold:g}), {what}' for preset, threshold in PRESETS.items()
               for what in ('kept', 'wrong'))), rows,
        'Of all pixels with truth, also of those that one camera sees; profile realtime, cold.')


def _much_worse(results, rivals):
    """Return the sentence about scenes where the best tuned rival is far ahead."""
    found = []
    for result in results:
        best = min((result.bad[name], name) for name in rivals if name in result.bad)
        if result.bad[OURS] > MUCH_WORSE * best[0]:
            found.append(f'{result.scene.path} ({result.bad[OURS]:.2f} against {best[0]:.2f}, '
                         f'{best[1]})')
    return ('More than 1.5 times worse than the best tuned rival: '
            + (', '.join(found) if found else 'on no scene') + '.')


def _title(group, found):
    return f'{group} ({len(found)})'


def _means(found, figure, contestants):
    return [_mean(found, figure, name) for name in contestants]


def _mean(found, figure, name):
    """Return the mean of a figure over results; None where one of them lacks it."""
    return _mean_of([getattr(result, figure).get(name) for result in found])


def _mean_of(values):
    return None if None in values or not values else float(np.mean(values))
