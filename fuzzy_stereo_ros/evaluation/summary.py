# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The report of an evaluation: tables of families, times, scenes and sequences; its settings."""
from dataclasses import replace

from fuzzy_stereo_ros.evaluation.ground_truth import ALL, DISC, LIMITS, MASKS, NONOCC
from fuzzy_stereo_ros.evaluation.matchers import OpenCV, Ours, ResultFiles
from fuzzy_stereo_ros.evaluation.measuring import by_family, FILLED, RAW, ROWS
from fuzzy_stereo_ros.evaluation.report import environment, Report, Table
from fuzzy_stereo_ros.evaluation.scores import THRESHOLDS

NAMED = 6       # scenes that a sentence still names
KINDS = {RAW: 'sparse', FILLED: 'dense'}
HEADINGS = ('density [%]', *(f'bad-{limit:g} [%]' for limit in THRESHOLDS), 'D1 [%]',
            'average [px]', 'RMS [px]')
MEANING = {NONOCC: 'pixels that both cameras see', ALL: 'all pixels with a truth',
           DISC: 'near jumps of disparity'}
EXPLANATION = ('*sparse*: of the pixels that the matcher gives a disparity; *dense*: gaps filled, '
               'all pixels count. bad-N: off by more than N px; D1: off by more than 3 px and 5 '
               'percent of the truth.')


def report_of(results, sequences, means, matchers, settings, skipped):
    """
    Return the `Report` of `Result`s of scenes and of sequences, and of `mean_records`.

    settings: {what: how} of the command; skipped: sentences.
    """
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
    tables += _rows([*results, *sequences])
    return Report('evaluate', 'Evaluation', {
        **environment(settings['threads']), **_settings(results, sequences, matchers, settings)},
        tables, [*skipped, *_left_out(results, matchers, families)])


def _means(means):
    """Return a table for each mask that scenes of a family have, of the family's mean records."""
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
    """Return the figures of a record in the columns HEADINGS."""
    kind = KINDS[record['map']]
    return [record[name] for name in (
        'density', *(f'bad_{kind}_{limit:g}' for limit in THRESHOLDS), f'd1_{kind}',
        'average_error', 'rms_error')]


def _times(families, means, matchers):
    """Return the table of times and speeds, by family."""
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
    """Return the matchers that have a result on one of the scenes."""
    return [matcher for matcher in matchers
            if any(result.record(matcher.name) for result in results)]


def _scenes(results, matchers):
    """Return the table with a line for each scene of a family."""
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
    """Return the table with a line for each start of each matcher on each sequence."""
    rows = []
    for result in results:
        limit, runs = result.subject.limit, {}
        for record in result.records:      # the first two are of the mask that counts most
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


def _rows(results):
    """Return the table of row offsets, a line for each scene and sequence; [] of none."""
    measured = [(result.subject.path, record) for result in results for record in [next(
        (one for one in result.records if one.get(ROWS[0]) is not None), None)] if record]
    return [Table(
        'Row offsets', ('', 'offset [px]', 'by roll [px]', 'by zoom [px]', 'doubt [px]', ''),
        [(path, *(record[name] for name in ROWS[:-1]), record[ROWS[-1]] or 'fits')
         for path, record in measured],
        'By how much the right image stands lower than the left one: in the middle, and how much '
        'more at the right edge (roll) and at the lower edge (zoom). *doubt*: the largest '
        'standard deviation of the three.')] if measured else []


def _settings(results, sequences, matchers, settings):
    """Return {what: how}: what the figures depend on."""
    told = {
        **settings,
        'scenes': ', '.join(f'{len(those)} {family}' for family, those in by_family(
            results).items()) or 'none',
        'disparities': _told_by([*results, *sequences]),
    }
    for matcher in matchers:
        if isinstance(matcher, Ours):
            told[matcher.name] = (f'{matcher.description}, from the left image as it comes; fills '
                                  'by itself')
        elif isinstance(matcher, ResultFiles):
            told[matcher.name] = f'files of {matcher.folder}; gaps filled as those of OpenCV'
    if any(isinstance(matcher, OpenCV) for matcher in matchers):
        told['opencv'] = (
            "grey images, at the defaults of stereo_image_proc or tuned for the scenes' family "
            '(left border padded; settings in evaluation/baselines.py); gaps filled '
            'from the background side on their row, then a 5x5 median')
    derived = [one.subject.path for one in results if one.subject.files[''].derives_visibility]
    if derived:
        told['nonocc'] = (f'found from the truth where no mask comes with it ({_some(derived)}): '
                          'its match lies inside the right image, and nothing nearer hides it '
                          'there')
    whole = [one.subject.path for one in results if one.subject.files[''].whole_pixel]
    if whole:
        told['rounded'] = f'{_some(whole)}: the truth has whole pixels'
    return told


def _left_out(results, matchers, families):
    """Return the sentences about matchers that lack results."""
    sentences = []
    for matcher in matchers:
        if isinstance(matcher, OpenCV):
            sentences += [f'{matcher.name} has no settings for {family}: it takes no part there'
                          for family in families if matcher.settings(family) is None]
        if isinstance(matcher, ResultFiles):
            missing = [one.subject.path for one in results if one.record(matcher.name) is None]
            if missing:
                sentences.append(f'{matcher.folder} has no result of {_some(missing)}: no means '
                                 f'of {matcher.name} there')
    return sentences


def _told_by(results):
    """Return how many disparities were searched, and who says so."""
    told = {}
    for result in results:
        told.setdefault(result.told_by, []).append(f'{result.subject.path}: {result.disparities}')
    return 'searched from 0; how many is told by ' + '; '.join(
        f'{who} ({_some(names)})' for who, names in told.items())


def _some(names):
    """Return names as a list of words, or how many they are."""
    return ', '.join(names) if len(names) <= NAMED else f'{len(names)} scenes'
