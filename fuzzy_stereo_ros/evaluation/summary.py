# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The report of an evaluation: tables of families, times, scenes, sequences, and settings."""
from dataclasses import replace

from fuzzy_stereo_ros.evaluation.ground_truth import ALL, DISC, LIMITS, MASKS, NONOCC
from fuzzy_stereo_ros.evaluation.matchers import COLD, OpenCV, Ours, ResultFiles
from fuzzy_stereo_ros.evaluation.measuring import by_family, FILLED, RAW, ROWS
from fuzzy_stereo_ros.evaluation.report import environment, Report, Table
from fuzzy_stereo_ros.evaluation.scores import THRESHOLDS
import pandas as pd

NAMED = 6       # scenes that a sentence lists by name; of more it gives the number
KINDS = {RAW: 'sparse', FILLED: 'dense'}
HEADINGS = ('density [%]', *(f'bad-{limit:g} [%]' for limit in THRESHOLDS), 'D1 [%]',
            'average [px]', 'RMS [px]')
MEANING = {NONOCC: 'pixels that both cameras see', ALL: 'all pixels with a truth',
           DISC: 'near jumps of disparity'}
EXPLANATION = ('*sparse*: of the pixels that the matcher gives a disparity; *dense*: gaps filled, '
               'all pixels count. bad-N: off by more than N px; D1: off by more than 3 px and 5 '
               'percent of the truth.')
OWN = {'covered': 'density [%]', 'agree': 'agree with the right image [%]',
       'confidence': 'confidence', 'flicker': 'flicker [%]', 'milliseconds': 'time [ms]'}
OWN_EXPLANATION = (
    '*agree*: of the pixels with a disparity whose match in the right image has one, too, those '
    'that have the same one within 1 px. *flicker*: pixels that change by more than 1 px from a '
    'frame to the next one; where the camera or things move that is no error. None of these tells '
    'whether a disparity is right.')


def report_of(results, sequences, means, matchers, settings, skipped):
    """
    Return the `Report` of an evaluation.

    results, sequences: `Result`s of scenes and of sequences; means: of `mean_records`; matchers:
    in their order; settings: {what: how}, with 'threads'; skipped: sentences on what is left out
    """
    every, own = [*results, *sequences], [
        one for one in (*results, *sequences) if not one.has_truth]
    results, sequences = ([one for one in those if one.has_truth]
                          for those in (results, sequences))
    families = by_family(results)
    tables = [table for family in families for table in _means(
        [record for record in means if record['family'] == family])]
    if tables:
        tables[0] = replace(tables[0], note=EXPLANATION)
    if families:
        tables.append(_times(families, means, matchers))
    tables += [_scenes(those, matchers) for those in families.values()]
    if sequences:
        tables.append(_sequences(sequences))
    tables += _without_truth(own)
    tables += _row_offsets(every)
    return Report('evaluate', 'Evaluation', {
        **environment(settings['threads']), **_settings(results, every, matchers, settings)},
        tables, [*skipped, *_left_out(results, matchers), *_hints(every)])


def _means(means):
    tables = []
    for mask in MASKS:
        records = [record for record in means if record['mask'] == mask]
        if records:
            count = records[0]['frames']
            tables.append(Table(
                f"{records[0]['family']}, {mask} ({MEANING[mask]}): mean of {count} scene"
                + 's' * (count != 1), ('', 'map', *HEADINGS),
                [(one['matcher'], KINDS[one['map']], *_figures(one)) for one in records]))
    return tables


def _figures(record):
    kind = KINDS[record['map']]
    return [record[name] for name in (
        'density', *(f'bad_{kind}_{limit:g}' for limit in THRESHOLDS), f'd1_{kind}',
        'average_error', 'rms_error')]


def _times(families, means, matchers):
    times = {(one['family'], one['matcher']): (one['milliseconds'], one['mde_per_second'])
             for one in means}
    rows = [(matcher.name, *(figure for family in families
                             for figure in times.get((family, matcher.name), (None, None))))
            for matcher in _present(matchers, [one for those in families.values()
                                               for one in those])]
    return Table('Time', ('', *(f'{family} [{unit}]' for family in families
                                for unit in ('ms', 'MDE/s'))), rows,
                 'Mean of a pair, and million disparity estimates (pixels times disparities asked '
                 'for) per second.', digits=1)


def _present(matchers, results):
    return [matcher for matcher in matchers
            if any(result.record(matcher.name) for result in results)]


def _scenes(results, matchers):
    family = results[0].subject.family
    present = _present(matchers, results)
    return Table(
        f'{family}, scenes: bad-{LIMITS[family]:g}, dense, percent',
        ('', 'size', 'disparities', 'pixels', *(matcher.name for matcher in present)),
        [(result.subject.path, f'{result.size[1]}x{result.size[0]}', result.disparities,
          result.records[0]['mask'] if result.records else None,
          *(result.main_error(matcher.name) for matcher in present))
         for result in results], f'*pixels*: those that count, {NONOCC} where that is known.')


def _sequences(results):
    rows = []
    for result in results:
        limit, runs = result.subject.limit, {}
        for record in result.records:      # the first two are of the most important mask
            runs.setdefault((record['matcher'], record['start']), []).append(record)
        for (name, start), (raw, filled, *_) in runs.items():
            rows.append((
                f'{result.subject.path}: {name}' + f', {start}' * bool(start), raw['frames'],
                raw['truths'], f'{limit:g} px', raw.get(f'bad_sparse_{limit:g}'),
                filled.get(f'bad_dense_{limit:g}'), raw['covered'], raw['flicker'],
                filled['flicker'], raw['milliseconds']))
    return Table(
        'Sequences', ('', 'frames', 'with a truth', 'limit', 'bad, sparse [%]', 'bad, dense [%]',
                      'covered [%]', 'flicker, sparse [%]', 'flicker, dense [%]', 'time [ms]'),
        rows, 'Mean over frames. *cold*: the frame before is forgotten; *warm*: the frame before '
              'takes part. *bad*: of frames with a truth, where both cameras see if that is '
              'known. *covered*: all pixels with a disparity. *flicker*: pixels that change by '
              'more than 1 px from frame to frame, those that really move among them.')


def _without_truth(results):
    """Return the tables of what has no ground truth: the means, and, of more than one, each."""
    rows = pd.DataFrame([
        (result.subject.path, one['matcher'], one['start'] or COLD, *map(one.get, OWN))
        for result in results for one in result.records if one['map'] == RAW],
        columns=('', 'matcher', 'start', *OWN.values())).astype(dict.fromkeys(OWN.values(), float))
    if not len(rows):
        return []
    means = rows.drop(columns='').groupby(['matcher', 'start'], sort=False).mean().reset_index(1)
    title = 'Without ground truth'
    if len(results) == 1:
        return [Table.of(title, means, OWN_EXPLANATION)]
    return [Table.of(f'{title}, mean of {len(results)}', means, OWN_EXPLANATION),
            Table.of(f'{title}, each', rows.set_index(''))]


def _row_offsets(results):
    """Return [the table of row offsets], a row for each scene and sequence; [] without any."""
    measured = [(result.subject.path, record) for result in results for record in [next(
        (one for one in result.records if one.get(ROWS[0]) is not None), None)] if record]
    return [Table(
        'Row offsets', ('', 'tilt [px]', 'roll [px]', 'zoom [px]', 'yaw [px]', 'doubt [px]', ''),
        [(path, *(record[name] for name in ROWS[:-1]), record[ROWS[-1]] or 'fits')
         for path, record in measured],
        'By how much the right image stands lower than the left one: in the centre (tilt), and '
        'how much more at the right edge (roll), at the lower edge (zoom) and in the lower right '
        'corner (yaw); ours undoes it before matching. *doubt*: the largest standard deviation '
        'of the four.')] if measured else []


def _settings(results, every, matchers, settings):
    """Return {what: how} of everything that the figures depend on; results: with a truth."""
    texts = {
        **settings,
        'scenes': ', '.join(f'{len(those)} {family}' for family, those in by_family(
            results).items()) or 'none',
        'disparities': _sources(every),
    }
    for matcher in matchers:
        if isinstance(matcher, Ours):
            texts[matcher.name] = (f'{matcher.description}, of the left image as it comes; fills '
                                   'gaps itself')
        elif isinstance(matcher, ResultFiles):
            texts[matcher.name] = f'files of {matcher.folder}; gaps filled as those of OpenCV'
    if any(isinstance(matcher, OpenCV) for matcher in matchers):
        texts['opencv'] = (
            "grey images, at the defaults of stereo_image_proc or tuned for the scenes' family "
            '(left border padded; settings in evaluation/baselines.py); gaps filled '
            'from the background side on their row, then a 5x5 median')
    derived = [one.subject.path for one in results if one.subject.files[''].derives_visibility]
    if derived:
        texts['nonocc'] = (f'derived from the truth where there is no mask ({_listed(derived)}): '
                           'the match lies inside the right image, and no nearer surface '
                           'occludes it')
    return texts


def _hints(results):
    found = {result.subject.path: next((one['hint'] for one in result.records if one.get('hint')),
                                       None) for result in results}
    return [f'hint: {path}: {hint}' for path, hint in found.items() if hint]


def _left_out(results, matchers):
    sentences = []
    for matcher in matchers:
        if isinstance(matcher, ResultFiles):
            missing = [one.subject.path for one in results if one.record(matcher.name) is None]
            if missing:
                sentences.append(f'{matcher.folder} has no result of {_listed(missing)}: no means '
                                 f'of {matcher.name} there')
    return sentences


def _sources(results):
    by_source = {}
    for result in results:
        by_source.setdefault(result.source, []).append(
            f'{result.subject.path}: {result.disparities}')
    return 'searched from 0; their number is from ' + '; '.join(
        f'{source} ({_listed(names)})' for source, names in by_source.items())


def _listed(names):
    """Return names as a list, or the number of scenes if there are many."""
    return ', '.join(names) if len(names) <= NAMED else f'{len(names)} scenes'
