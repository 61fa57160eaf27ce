# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Results as flat records, for programs: the rows of a CSV file, the same in JSON."""
import csv
import io

from fuzzy_stereo_ros.evaluation.measuring import mean_scores
from fuzzy_stereo_ros.evaluation.scores import THRESHOLDS
import numpy as np

WAYS = 'as it comes', 'filled'
SCENE, SEQUENCE, MEAN = 'scene', 'sequence', 'mean'
COLUMNS = (
    'kind', 'name', 'layout', 'family', 'rows', 'columns', 'disparities', 'disparities_told_by',
    'frames', 'matcher', 'start', 'milliseconds', 'mde_per_second', 'covered', 'flicker', 'mask',
    'map', 'pixels', 'density', *(f'bad_{kind}_{limit:g}' for kind in ('sparse', 'dense')
                                  for limit in THRESHOLDS),
    'd1_sparse', 'd1_dense', 'average_error', 'rms_error')


def records_of(results, sequences):
    """
    Return the records of lists of `Result`s, as dicts whose keys are among COLUMNS.

    There is one for each matcher, start, mask and map (as it comes, filled): of each scene, each
    sequence, and for the scenes of a family their mean, if the matcher has a map of all of them;
    `frames` then says how many scenes have the mask.
    """
    records = []
    for kind, those in ((SCENE, results), (SEQUENCE, sequences)):
        for result in those:
            shared = {
                'kind': kind, 'name': result.found.name, 'layout': result.found.layout,
                'family': result.found.family, 'rows': result.size[0],
                'columns': result.size[1], 'disparities': result.disparities,
                'disparities_told_by': result.told_by, 'frames': result.frames}
            for (name, start), outcome in result.outcomes.items():
                records += _of_outcome({**shared, 'matcher': name, 'start': start}, outcome)
    for family, those in by_family(results).items():
        for name, start in contestants_of(those):
            shared = {'kind': MEAN, 'name': family, 'family': family, 'matcher': name,
                      'start': start, 'milliseconds': mean_time(those, name, start),
                      'mde_per_second': mean_speed(those, name, start)}
            for mask, scores in means_of(those, name, start).items():
                records += _of_scores({**shared, 'frames': with_mask(those, mask)},
                                      {mask: scores})
    return records


def by_family(results):
    """Return {family: results}, in the order of their first scenes."""
    families = {}
    for result in results:
        families.setdefault(result.found.family, []).append(result)
    return families


def contestants_of(results):
    """Return the (name, start) that have an outcome in one of the results, in their order."""
    # Who has nothing on some scenes keeps his place if those with all of them are asked first.
    fullest = sorted(results, key=lambda result: -len(result.outcomes))
    return list(dict.fromkeys(key for result in fullest for key in result.outcomes))


def means_of(results, name, start):
    """Return {mask: `Scores`}, means over results; {} where one of them lacks an outcome."""
    if not all((name, start) in result.outcomes for result in results):
        return {}
    return mean_scores([result.outcomes[name, start].scores for result in results])


def with_mask(results, mask):
    """Return how many of the results have a mask."""
    return sum(mask in result.masks for result in results)


def mean_time(results, name, start):
    """Return the mean milliseconds over results; None where one of them is not known."""
    times = _times(results, name, start)
    return None if None in times else float(np.mean(times))


def mean_speed(results, name, start):
    """Return million disparities per second over all results; None where a time is not known."""
    times = _times(results, name, start)
    if None in times:
        return None
    tried = sum(result.size[0] * result.size[1] * result.disparities for result in results)
    return tried / sum(times) / 1000


def csv_of(records):
    """Return records as the text of a CSV file; a figure over nothing is an empty cell."""
    written = io.StringIO()
    writer = csv.DictWriter(written, COLUMNS, lineterminator='\n')
    writer.writeheader()
    writer.writerows({name: '' if value is None or value != value else value
                      for name, value in record.items()} for record in records)
    return written.getvalue()


def _times(results, name, start):
    outcomes = [result.outcomes.get((name, start)) for result in results]
    return [None if outcome is None else outcome.milliseconds for outcome in outcomes]


def _of_outcome(shared, outcome):
    return _of_scores({**shared, 'milliseconds': outcome.milliseconds,
                       'mde_per_second': outcome.speed, 'covered': outcome.covered},
                      outcome.scores, outcome.flickers)


def _of_scores(shared, scores, flickers=None):
    """Return a record for each mask and map; where there is no mask, for each map."""
    records = []
    for mask, of_mask in (scores or {'': None}).items():
        for place, way in enumerate(WAYS):
            record = {**shared, 'mask': mask, 'map': way}
            if flickers is not None:
                record['flicker'] = flickers[place]
            if of_mask is not None:
                record.update(_figures(of_mask.filled if place else of_mask.found))
            records.append(record)
    return records


def _figures(one):
    """Return the figures of a `Score` by the names of the columns."""
    return {
        'pixels': one.pixels, 'density': one.density,
        **{f'bad_{kind}_{limit:g}': percent
           for kind, percents in (('sparse', one.bad_sparse), ('dense', one.bad_dense))
           for limit, percent in percents.items()},
        'd1_sparse': one.d1_sparse, 'd1_dense': one.d1_dense,
        'average_error': one.average_error, 'rms_error': one.rms_error}
