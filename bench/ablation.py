# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Ablation: each profile as it is, and with parts removed or replaced, on scenes and sequences.

All fitness values are measured by the matcher as it is, so that they compare.
"""
from dataclasses import replace
from functools import partial
from typing import NamedTuple

from bench.conditions import under_condition
from bench.datasets import NOISES
from bench.draws import by_draw, in_words, means_over_draws, over_draws
from bench.page import BLUE, column, figure_of, GREY, LIGHT_BLUE, ORANGE, titled
from bench.request import counted, figures_of_sequence, halved, means, report_of
from bench.scoring import bad_percent, REFERENCE
from bench.truth import correlation_table, genes_of, truth_beside_result
from bench.variants import DEFAULT, NOT_FOLLOWED, PAPER, QUALITY, REALTIME
from bench.warm import FRAMES, QUICK_FRAMES, walks
from fuzzy_stereo_ros.evaluation.baselines import dense, grey
from fuzzy_stereo_ros.evaluation.catalogue import Scene
from fuzzy_stereo_ros.evaluation.report import mean, Table
import numpy as np
import pandas as pd

SIGNED = '{:+.2f}'.format       # of differences
TURNS = 3           # runs, of which the fastest counts
NOTABLE = 0.05      # percentage points of error: a smaller difference is none
PROFILES = {'realtime': REALTIME, 'quality': QUALITY, 'paper': PAPER}
PARTS = 'population', 'crossover', 'mutation', 'previous best'
CLASSIC = 'middv2'
# Scenes for the ablation of profiles that take seconds: classic, plain, textured, road.
SHOWN = ('midd2006_third/Midd1', 'midd2006_third/Flowerpots', 'midd2006_third/Rocks1',
         'midd2006_third/Wood1',
         'kitti/kitti2012_color/000000')
# kinds of sequences on which the previous best is taken away
NOISY = [f'window, noise {noise}' for noise in NOISES if noise]
STILL = 'still, noise 1.5'  # sequences on which each part is taken away; their last frame counts
# {profile that takes seconds: (the profile that matches STILL, number of its frames, scenes)}
LIVED = {'quality': ('quality', 8, ('middv2/tsukuba', 'middv2/teddy', *SHOWN[:2])),
         'paper': ('paper_live', 16, ('middv2/tsukuba', 'middv2/venus', 'middv2/teddy',
                                      'middv2/cones'))}
SINGLE = 'single pairs'
# conditions of bench.conditions
COMPRESSED, NOISED = 'both JPEG 95', 'shot and read noise, unlike columns'
EARNS = 3.0                 # percent of the mean error by which a part earns its place
ROOM = 2.4          # longest bar as a multiple of the first one; longer ones are cut


class Evolution(NamedTuple):
    """
    A scene for the ablation of a profile that takes seconds, seen for so many frames.

    condition: one of bench.conditions, '' = as it is. noise: whether it is random.
    """

    profile: str
    scene: Scene
    frames: int = 1
    condition: str = ''
    noise: bool = False


def run(request):
    """Return the `Report` of the contribution of each part of each profile."""
    scenes, skipped = request.scenes()
    sequences, missing = request.sequences(scenes)
    sequences = [*(one for one in sequences if len(one.scored)), *(
        replace(one, group=STILL) for one in walks(scenes, request.quick, [STILL]))]
    trials, harder, points, truths = (
        pd.DataFrame([row for rows in parts for row in rows]) for parts in zip(*request.each(
            scenes, 'scenes', lambda scene: on_scene(scene, request.ours))))
    moving, evolved, lived = request.drawn(
        (sequences, 'sequences', partial(on_sequence, request.ours)),
        (evolutions(scenes, request.quick), 'evolutions', evolve),
        (lives(scenes, request.quick), 'over frames', live), timed=True)
    found = [balance_table(pd.concat([
        of_parts(trials, harder, moving).assign(profile='realtime'),
        evolved, lived]))]
    found += [evolution_table(*which, rows)
              for which, rows in evolved.groupby(['profile', 'condition'], sort=False)]
    found += scene_tables(trials) + (sequence_tables(moving) if len(moving) else [])
    return report_of('ablation', 'Ablation', {
        'as it is': f'{request.ours.description}, filled; on single scenes cold',
        'baseline': '3WAY, tuned for the family, dense; its fitness is that of its map in whole '
                    'pixels',
        'error': 'percent of pixels off by more than 1 px (Middlebury, made; pixels that both '
                 'cameras see) or 3 px (KITTI; all with truth); after the same refinement',
        'fitness': 'of the best chromosome before refinement, by the fitness of the matcher as it '
                   'is, measured everywhere; 1 would be fully possible and smooth',
        **in_words(request.draws),
        'time': f'all variants in turns, without noise; scenes: minimum of {TURNS}; sequences: '
                'median of the frames after the first; the replaced possibility is written to '
                'compare, not to be fast: no times of it',
        'sequences': f'those of the benchmark `warm`, scored as there; {STILL}: frame '
                     f'{FRAMES[-1]}, of the others the frame that is named',
        'earns': f'how much of the error without it a part takes away; {EARNS:.0f} % earns its '
                 'place',
    }, [*found, correlation_table(points, truths)], [*skipped, *missing],
        {'ablation.svg': draw_ablation})


def on_scene(scene, ours):
    """
    Return the figures of the variants and of a baseline on a scene: four lists of dicts.

    Error, fitness and milliseconds of each variant; what `on_harder_pictures` returns; fitness and
    error of all different chromosomes of the evolutions; the figures of `truth_beside_result`.
    """
    pair, named = scene.read(), {'group': scene.group, 'scene': scene.path, 'draw': 0}
    matchers = _matchers(ours, scene, [one for one in REALTIME if one.still])
    seen, matches = {}, {name: [] for name in matchers}

    def observe(_, population):
        seen.update({member.tobytes(): member.copy() for member in population})

    for turn in range(TURNS + 1):       # the first one observes, the others are timed
        for name, matcher in matchers.items():
            matcher.restore(None)
            matches[name].append(matcher.match(pair.left, pair.right,
                                               observe=None if turn else observe))
    default = matchers[DEFAULT.name]
    fitness_of, trials = default.algorithm.fitness_of, []
    for name, matcher in matchers.items():
        fittest = matcher.algorithm.population.genes[:1]
        observe(None, fittest)
        trials.append({**named, 'name': name, 'fitness': fitness_of(fittest[0]),
                       'error': bad_percent(matches[name][-1].disparity, pair, scene.limit),
                       'milliseconds': min(match.times['total'] for match in matches[name][1:])})
    disparity = dense(REFERENCE.matcher(scene.family, scene.disparities).match(
        pair.left, pair.right))
    trials.append({**named, 'name': REFERENCE.name, 'fitness': fitness_of(genes_of(
        disparity, default)), 'error': bad_percent(disparity, pair, scene.limit)})
    points = [{'scene': scene.path, 'fitness': fitness_of(genes), 'error': bad_percent(
        genes.astype(np.float32), pair, scene.limit)} for genes in seen.values()]
    return (trials, on_harder_pictures(ours, scene, pair), points,
            [{'scene': scene.path, **truth_beside_result(scene, pair, default)}])


def on_harder_pictures(ours, scene, known):
    """Return dicts of variants without a part in harder pictures: scene, draw, on, name, error."""
    chosen = [one for one in REALTIME if one.still and (one.part or one == DEFAULT)]
    blocks = under_condition(known, COMPRESSED)
    found = []
    for what, images in (('grey', (grey(known.left), grey(known.right))),
                         (COMPRESSED, (blocks.left, blocks.right))):
        found += [{'scene': scene.path, 'draw': 0, 'on': on_single(what), 'name': name,
                   'error': bad_percent(matcher.match(*images).disparity, known, scene.limit)}
                  for name, matcher in _matchers(ours, scene, chosen).items()]
    return found


def on_single(condition):
    """Return what is measured on: single pairs, under a condition if there is one."""
    return ', '.join(filter(None, (SINGLE, condition)))


def on_sequence(ours, sequence, draw):
    """Return a dict for each variant: kind, scene, name, error, flicker, fitness, milliseconds."""
    frames = sequence.drawn(draw)
    matchers = _matchers(ours, sequence, [one for one in REALTIME if one.moving])
    matches, fitness = ({name: [] for name in matchers} for _ in range(2))
    for pair in frames:
        for name, matcher in matchers.items():
            camera = None if name == NOT_FOLLOWED else sequence.camera
            matches[name].append(matcher.match(pair.left, pair.right, camera=camera))
            fitness[name].append(matchers[DEFAULT.name].algorithm.fitness_of(
                matcher.algorithm.population.genes[0]))
    scored = [number for number in sequence.scored if frames[number].truth is not None]
    return [{'kind': sequence.group.split(', pan')[0], 'scene': sequence.path, 'name': name,
             **figures_of_sequence(sequence, frames, [match.disparity for match in several]),
             'fitness': mean(fitness[name][number] for number in scored),
             'milliseconds': None if sequence.noise else float(np.median(
                 [match.times['total'] for match in several[1:]]))}
            for name, several in matches.items()]


def evolutions(scenes, quick):
    """
    Return the `Evolution`s: `quality` on classic and SHOWN scenes, `paper` on classic ones.

    `quality` also with noise, where more depends on what judges a proposal; then on all of KITTI.
    """
    classic = [scene for scene in scenes if scene.group == CLASSIC]
    shown = [scene for scene in scenes if scene.group == CLASSIC or scene.path in SHOWN]
    noised = [scene for scene in scenes if scene in shown or scene.group == 'kitti']
    if quick or not shown:
        noised = shown = classic = scenes[:1]
    return [*(Evolution('quality', scene) for scene in shown),
            *(Evolution('quality', scene, condition=NOISED, noise=True) for scene in noised),
            *(Evolution('paper', scene) for scene in classic)]


def evolve(one, draw):
    """
    Return a dict for each variant.

    profile, group, scene, condition, on, name, error, fitness, milliseconds: None with noise
    """
    found, scene, pair = [], one.scene, one.scene.read()
    pair = under_condition(pair, one.condition, draw) if one.condition else pair
    for variant in (variant for variant in PROFILES[one.profile] if variant.still):
        matcher = variant.matcher(one.profile, scene.disparities)
        matcher.warm_up(*pair.left.shape[:2])
        match = matcher.match(pair.left, pair.right)
        population = matcher.algorithm.population
        found.append({'profile': one.profile, 'group': scene.group, 'scene': scene.path,
                      'name': variant.name, 'condition': one.condition,
                      'on': on_single(one.condition),
                      'error': bad_percent(match.disparity, pair, scene.limit),
                      'fitness': float(population.fitness[population.best]),
                      'milliseconds': None if one.noise else match.times['total']})
    return found


def lives(scenes, quick):
    """Return an `Evolution` over frames for each scene of each profile of LIVED."""
    return [Evolution(profile, scene, QUICK_FRAMES[-1] if quick else frames, noise=True)
            for profile, (_, frames, paths) in LIVED.items()
            for scene in (scenes[:1] if quick else scenes) if quick or scene.path in paths]


def live(one, draw):
    """Return a dict for each variant over frames: profile, scene, name, error, on."""
    name, scene = LIVED[one.profile][0], one.scene
    on = f'{name}: {STILL}, frame {one.frames}'
    (walk,), found = walks([scene], False, [STILL], one.frames), []
    frames = walk.drawn(draw)
    for variant in (DEFAULT, *(one for one in PROFILES[one.profile] if not one.still)):
        matcher = variant.matcher(name, scene.disparities, {'warm_start': True})
        for pair in frames:
            match = matcher.match(pair.left, pair.right)
        found.append({'profile': one.profile, 'scene': scene.path, 'name': variant.name, 'on': on,
                      'error': bad_percent(match.disparity, frames[-1], scene.limit)})
    return found


def of_parts(trials, harder, moving):
    """
    Return the rows of a DataFrame for `balance_table`, with a column `on`.

    trials, harder, moving: DataFrames of single scenes, of harder pictures and of sequences.
    """
    parts = [trials.assign(on=SINGLE), harder]
    if len(moving):
        chosen = [one.name for one in REALTIME if one.part == 'previous best' or one == DEFAULT]
        parts += [moving[moving.kind.isin(NOISY) & moving.name.isin(chosen)].assign(
            on='windows with noise'), moving[moving.kind == STILL].assign(on=STILL)]
    return pd.concat(parts)


def _matchers(ours, subject, variants):
    """Return {name of a variant: its `StereoMatcher`} for a scene or a sequence."""
    return {one.name: one.matcher(ours.profile, subject.disparities, ours.changes)
            for one in variants}


def balance_table(found):
    """Return the table of what parts earn, of a DataFrame of errors on scenes and draws."""
    rows = []
    for profile, variants in PROFILES.items():
        errors = found[found.profile == profile].pivot(
            index=['on', 'scene', 'draw'], columns='name', values='error')
        for part in PARTS:
            chosen = [variant.name for variant in variants if variant.part == part]
            for name in (name for name in chosen if name in errors):
                both = errors[[DEFAULT.name, name]].dropna()
                for measured_on, figures in both.groupby('on', sort=False):
                    each = figures.groupby('draw').mean().T
                    earned = (100 - 100 * each[:1] / each.loc[name]).fillna(0)
                    rows.append((
                        profile, part, name, measured_on,
                        figures.index.get_level_values('scene').nunique(), *over_draws(each),
                        SIGNED(over_draws(earned, 'min').iloc[0])))
            if not chosen:
                rows.append((profile, part, 'one chromosome: none to take away', *5 * [None]))
    return Table('What each part of each profile earns', (
        'profile', 'part', 'without it', 'on', 'scenes', 'error as it is [%]',
        'error without it [%]', 'earns [%]'), rows)


def evolution_table(profile, condition, found):
    """Return the table of errors, times and fitness; found: DataFrame of `evolve`."""
    named = counted(found) if condition else found.assign(
        group=found.scene.str.partition('/')[2])
    table = means_over_draws(named, ['name', 'group'], ['error'])['error'].unstack(
        'group', sort=False)
    each, means = by_draw(found, ['name'], 'error'), found.groupby('name')[
        ['fitness', 'milliseconds']].mean()
    table['mean'], table['than as it is'] = over_draws(each), compared(each)
    if not condition:
        table['seconds'] = means.milliseconds / 1000
    table['fitness of its best'] = means.fitness.map('{:.4f}'.format)
    return Table.of(
        f"{', '.join(filter(None, (profile, condition)))}: error in percent", table,
        'Fitness compares only where the fitness itself is that of the profile as it is.')


def scene_tables(trials):
    """Return the tables of errors, fitness and times of scenes; trials: DataFrame."""
    names = trials.name.unique()
    errors = means(trials, 'error', names, 'name').T
    every = trials.pivot(index='name', columns='scene', values='error').loc[names]
    more = every - every.loc[DEFAULT.name]
    errors['mean of groups'] = errors.mean(axis=1)
    errors['than as it is'] = compared(by_draw(trials, ['name'], 'error'))
    for heading, which in (('worse on', more > NOTABLE), ('better on', more < -NOTABLE)):
        errors[heading] = which.sum(axis=1).astype(object).mask(errors.index == DEFAULT.name, None)
    made = [Table.of('Scenes: mean error of the groups in percent', errors,
                     f'*Worse on*, *better on*: scenes of {every.shape[1]} whose error is larger '
                     'or smaller than that of the matcher as it is by more than '
                     f'{NOTABLE} points.')]
    halves = halved(trials, 'name').pivot_table('error', 'name', ['group', 'half'], sort=False)
    if len(halves):
        made.append(Table.of('Scenes: odd and even ones of each group, mean error in percent',
                             halves.set_axis(map(', '.join, halves.columns), axis=1)))
    made.append(Table.of('Scenes: mean fitness of the groups',
                         means(trials, 'fitness', names, 'name').T, digits=4))
    times = means(trials, 'milliseconds', [
        one.name for one in REALTIME if one.still and one.timed], 'name').T
    times['of that as it is'] = (times / times.loc[DEFAULT.name]).mean(axis=1)
    return [*made, Table.of('Scenes: mean time of the groups in milliseconds', times)]


def sequence_tables(trials):
    """Return the tables of sequences, a column per kind; trials: DataFrame."""
    counts = trials.groupby('kind', sort=False).scene.nunique()
    names = trials.name.unique()
    errors, flickers = (
        means_over_draws(trials, ['name', 'kind'], [figure])[figure].unstack('kind').loc[
            names, counts.index].rename(columns=lambda kind: f'{kind} ({counts[kind]})')
        for figure in ('error', 'flicker'))
    for table, figure in ((errors, 'error'), (flickers, 'flicker')):
        # What has no noise is the same in all draws.
        each = by_draw(trials, ['name', 'kind'], figure).ffill(axis=1).groupby(
            'name', sort=False).mean()
        table['mean of kinds'], table['than as it is'] = over_draws(each), compared(each)
    errors['fitness'] = trials.groupby('name').fitness.mean().map('{:.4f}'.format)
    times = trials.dropna(subset='milliseconds').pivot(
        index='name', columns='scene', values='milliseconds')
    errors['time, of that as it is'] = (times / times.loc[DEFAULT.name]).median(axis=1)
    errors.loc[[one.name for one in REALTIME if one.moving and not one.timed],
               'time, of that as it is'] = None
    return [Table.of('Sequences: mean error in percent', errors),
            Table.of('Sequences: mean flicker in percent', flickers)]


def compared(each):
    """Return a Series of differences from the matcher as it is, in words; each: of `by_draw`."""
    more = over_draws(each - each.loc[DEFAULT.name]).map(SIGNED).astype(object)
    return more.mask(more.index == DEFAULT.name, None)


def draw_ablation(tables):
    """Return the Figure of errors on scenes and sequences and of times: bars per variant."""
    panels = [(title, column(titled(tables, start), heading), room)
              for title, start, heading, room in (
                  ('error on scenes [%]', 'Scenes: mean error', 'mean of groups', ROOM),
                  ('error on sequences [%]', 'Sequences: mean error', 'mean of kinds', ROOM),
                  ('time on scenes, as it is: 1', 'Scenes: mean time', 'of that as it is',
                   float('inf')))
              if any(table.title.startswith(start) for table in tables)]
    names = list(panels[0][1])
    for _, figures, _ in panels:        # after the first name
        names[1:1] = [name for name in figures if name not in names]
    figure = figure_of(4 + 2.4 * len(panels), 1.4 + 0.26 * len(names),
                       'Each part of the matcher removed or replaced: lower is better')
    for panel, (title, figures, room) in zip(figure.subplots(1, len(panels), sharey=True), panels):
        _draw_bars(panel, names, figures, room)
        panel.set_title(title, loc='left')
    figure.axes[0].set_yticks(range(len(names)), names)
    figure.axes[0].set_ylim(len(names) - 0.5, -0.5)
    return figure


def _draw_bars(panel, names, figures, room):
    """Draw a bar for each name that was measured, and a line at the first value."""
    usual, longest = figures[names[0]], max(figures.values())
    end = min(longest, room * usual)
    for place, name in enumerate(names):
        value, where, side, word = figures.get(name), usual, 'left', 'not measured'
        if value is not None:
            cut = value > end
            panel.barh(place, min(value, end), color=BLUE if place == 0 else
                       ORANGE if 'tuned' in name else LIGHT_BLUE)
            where, side = (end, 'right') if cut else (max(value, usual), 'left')
            word = f'{float(value):.2f}' + ' \N{BLACK RIGHT-POINTING TRIANGLE}' * cut
        panel.annotate(word, (where, place), xytext=(3 if side == 'left' else -3, 0),
                       textcoords='offset points', va='center', ha=side, fontsize=7.5,
                       color=GREY if value is None else 'black')
    panel.axvline(usual, color=BLUE, linewidth=0.8)
    panel.set_xlim(0, end if end < longest else 1.15 * end)
    panel.tick_params(axis='y', length=0)
