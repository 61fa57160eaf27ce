# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Results as tables: means of each family of scenes, times, scenes, sequences."""
from dataclasses import replace

from fuzzy_stereo_ros.evaluation.ground_truth import LIMITS
from fuzzy_stereo_ros.evaluation.pair_files import ALL, DISC, MASKS, NONOCC
from fuzzy_stereo_ros.evaluation.records import (
    by_family, contestants_of, mean_speed, mean_time, means_of, with_mask)
from fuzzy_stereo_ros.evaluation.report import Table
from fuzzy_stereo_ros.evaluation.scores import THRESHOLDS

SPARSE, DENSE = 'sparse', 'dense'
FIGURES = ('density [%]', *(f'bad-{limit:g} [%]' for limit in THRESHOLDS), 'D1 [%]',
           'average [px]', 'RMS [px]')
MEANING = {NONOCC: 'pixels that both cameras see', ALL: 'all pixels with a truth',
           DISC: 'near jumps of disparity'}
EXPLANATION = ('*sparse*: of the pixels that the matcher gives a disparity; *dense*: gaps filled, '
               'all pixels count. bad-N: off by more than N px; D1: off by more than 3 px and 5 '
               'percent of the truth.')


def tables_of(results, sequences):
    """Return the tables of lists of `Result`s: of scenes, and of sequences."""
    families = by_family(results)
    made = [table for family, those in families.items() for table in _means(family, those)]
    if made:
        made[0] = replace(made[0], note=EXPLANATION)
    if families:
        made.append(_times(families))
    made += [_scenes(family, those) for family, those in families.items()]
    return made + ([_sequences(sequences)] if sequences else [])


def label(name, start):
    """Return how a contestant is called where it starts in more than one way."""
    return f'{name}, {start}' if start else name


def figures_of(scores):
    """Return the two rows of `Scores`, sparse and dense, in the columns FIGURES."""
    found, filled = scores.found, scores.filled
    return [(SPARSE, found.density, *(found.bad_sparse[limit] for limit in THRESHOLDS),
             found.d1_sparse, found.average_error, found.rms_error),
            (DENSE, filled.density, *(filled.bad_dense[limit] for limit in THRESHOLDS),
             filled.d1_dense, filled.average_error, filled.rms_error)]


def _means(family, results):
    """Return a table for each mask that scenes of a family have."""
    means = {name: means_of(results, name, start) for name, start in contestants_of(results)}
    made = []
    for mask in MASKS:
        count = with_mask(results, mask)
        if count:
            made.append(Table(
                f'{family}, {mask} ({MEANING[mask]}): mean of {_counted(count, "scene")}',
                ('', 'map', *FIGURES),
                [(name, *row) for name, of_masks in means.items() if of_masks
                 for row in figures_of(of_masks[mask])]))
    return made


def _times(families):
    """Return the table of times and speeds, by family."""
    keys = contestants_of([result for results in families.values() for result in results])
    columns = [f'{family} [{unit}]' for family in families for unit in ('ms', 'MDE/s')]
    return Table('Time', ('', *columns), [
        (name, *(figure(results, name, start) for results in families.values()
                 for figure in (mean_time, mean_speed))) for name, start in keys],
        'Mean of a pair, and million disparity estimates (pixels times disparities asked for) per '
        'second.', digits=1)


def _scenes(family, results):
    """Return the table with a line for each scene of a family."""
    keys = contestants_of(results)
    return Table(
        f'{family}, scenes: bad-{LIMITS[family]:g}, dense, percent',
        ('', 'size', 'disparities', 'pixels', *(name for name, _ in keys)),
        [(result.found.name, f'{result.size[1]}x{result.size[0]}', result.disparities,
          result.masks[0] if result.masks else None, *(result.main_error(*key) for key in keys))
         for result in results], f'*pixels*: those that count, {NONOCC} where that is known.')


def _sequences(results):
    """Return the table with a line for each start of each contestant on each sequence."""
    rows = []
    for result in results:
        for (name, start), outcome in result.outcomes.items():
            scores = next(iter(outcome.scores.values()), None)
            limit = result.found.limit
            rows.append((
                f'{result.found.name}: {label(name, start)}', result.frames, result.truths,
                f'{limit:g} px', *((scores.found.bad_sparse[limit],
                                    scores.filled.bad_dense[limit]) if scores else (None, None)),
                outcome.covered, *outcome.flickers, outcome.milliseconds))
    return Table(
        'Sequences', ('', 'frames', 'with a truth', 'limit', 'bad, sparse [%]', 'bad, dense [%]',
                      'covered [%]', 'flicker, sparse [%]', 'flicker, dense [%]', 'time [ms]'),
        rows, 'Mean over frames. *cold*: the frame before is forgotten; *warm*: the frame before '
              'takes part. *bad*: of frames with a truth, where both cameras see if that is '
              'known. *covered*: all pixels with a disparity. *flicker*: pixels that change by '
              'more than 1 px from frame to frame, those that really move among them.')


def _counted(count, what):
    return f'{count} {what}' + 's' * (count != 1)
