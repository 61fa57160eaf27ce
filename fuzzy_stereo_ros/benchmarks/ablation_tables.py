# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The tables of the ablation."""
from fuzzy_stereo_ros.benchmarks.accuracy import grouped
from fuzzy_stereo_ros.benchmarks.correlation import correlation_table
from fuzzy_stereo_ros.evaluation.report import Table
import numpy as np

NOTABLE = 0.05      # points of error by which a scene counts as better or worse


def tables(still, moving, variants):
    """Return the tables of lists of `StillResult` and `MovingResult`; the first is the default."""
    default = variants[0].name
    groups = grouped(still)
    names = list(still[0].trials)
    found = {group: {name: [one.trials[name] for one in results] for name in names}
             for group, results in groups.items()}
    halves = {group: trials for group, trials in found.items() if len(trials[default]) > 1}
    headings = ('', *(f'{group} ({len(results)})' for group, results in groups.items()))
    made = [
        Table('Scenes: mean error of the groups in percent', (
            *headings, 'mean of groups', 'than as it is', 'worse on', 'better on'),
            [_error_row(name, still, found, default) for name in names],
            f'*Worse on*, *better on*: scenes of {len(still)} whose error is larger or smaller '
            f'than that of the matcher as it is by more than {NOTABLE} points.')]
    if halves:
        made.append(Table(
            'Scenes: odd and even ones of each group, mean error in percent',
            ('', *(f'{group}, {half}' for group in halves for half in ('odd', 'even'))),
            [(name, *(_mean(trial.error for trial in part) for trials in halves.values()
                      for part in (trials[name][::2], trials[name][1::2]))) for name in names]))
    made.append(Table(
        'Scenes: mean fitness of the groups', headings,
        [(name, *(_mean(trial.fitness for trial in trials[name]) for trials in found.values()))
         for name in names], digits=4))
    made.append(Table(
        'Scenes: mean time of the groups in milliseconds', (*headings, 'of that as it is'),
        [_time_row(variant.name, found, default) for variant in variants
         if variant.still and variant.timed]))
    if moving:
        made += _moving_tables(moving, variants)
    made.append(correlation_table({one.scene.path: one.points for one in still},
                                  {one.scene.path: one.truth for one in still}))
    return made


def _error_row(name, still, found, default):
    """Return the errors of a variant by group, and how they compare with the default's."""
    errors = [_mean(trial.error for trial in trials[name]) for trials in found.values()]
    more = [one.trials[name].error - one.trials[default].error for one in still]
    if name == default:
        return name, *errors, _mean(errors), *(None,) * 3
    return (name, *errors, _mean(errors), signed(_mean(more)),
            sum(step > NOTABLE for step in more), sum(step < -NOTABLE for step in more))


def _time_row(name, found, default):
    times, usual = ([_mean(trial.milliseconds for trial in trials[one])
                     for trials in found.values()] for one in (name, default))
    return name, *times, _mean(np.divide(times, usual))


def _moving_tables(moving, variants):
    """Return the tables of the sequences; windows of one noise share a column."""
    kinds = {}
    for one in moving:
        kinds.setdefault(one.sequence.kind.split(', pan')[0], []).append(one)
    headings = ('', *(f'{kind} ({len(results)})' for kind, results in kinds.items()),
                'mean of kinds', 'than as it is')
    chosen = [variant for variant in variants if variant.moving]
    errors, flickers = ({variant.name: [_mean(figure(one, variant.name) for one in results)
                                        for results in kinds.values()] for variant in chosen}
                        for figure in (lambda one, name: one.trials[name].error,
                                       lambda one, name: one.flickers[name]))
    return [
        Table('Sequences: mean error in percent', (*headings, 'fitness', 'time, of that as it is'),
              [(variant.name, *errors[variant.name], *_compared(errors, variant, chosen[0]),
                f'{_mean(one.trials[variant.name].fitness for one in moving):.4f}',
                _ratio(moving, variant, chosen[0])) for variant in chosen]),
        Table('Sequences: mean flicker in percent', headings,
              [(variant.name, *flickers[variant.name],
                *_compared(flickers, variant, chosen[0])) for variant in chosen])]


def _compared(found, variant, default):
    """Return the mean of a variant's figures, and how far it is from the default's."""
    mean = _mean(found[variant.name])
    return mean, None if variant is default else signed(mean - _mean(found[default.name]))


def _ratio(moving, variant, default):
    """Return a variant's time as part of the default's: the median of the sequences."""
    if not variant.timed:
        return None
    return float(np.median([one.trials[variant.name].milliseconds
                            / one.trials[default.name].milliseconds for one in moving]))


def signed(step):
    """Return a difference with its sign, as tables print it."""
    return f'{step:+.2f}'


def _mean(values):
    """Return the mean of what is known; NaN of nothing."""
    known = [value for value in values if not np.isnan(value)]
    return float(np.mean(known)) if known else float('nan')
