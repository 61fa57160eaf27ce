# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the figures of an evaluation depend on, in words."""
from fuzzy_stereo_ros.evaluation.matchers import OpenCV, Ours
from fuzzy_stereo_ros.evaluation.records import by_family
from fuzzy_stereo_ros.evaluation.report import environment
from fuzzy_stereo_ros.evaluation.result_files import Results

NAMED = 6       # scenes that a sentence still names


def settings_of(results, sequences, contestants, threads, repeats):
    """Return {what: how} of `Result`s of scenes and sequences; for `Report.settings`."""
    families = by_family(results)
    settings = {
        **environment(f'{threads} each'),
        'scenes': ', '.join(f'{len(those)} {family}' for family, those in families.items())
                  or 'none',
        'disparities': _told_by([*results, *sequences]),
    }
    for each in contestants:
        if isinstance(each, Ours):
            settings[each.name] = (f'{subject(each)}, from the left image as it comes; fills by '
                                   'itself')
        elif isinstance(each, Results):
            settings[each.name] = f'files of {each.folder}; gaps filled as those of OpenCV'
    if any(isinstance(each, OpenCV) for each in contestants):
        settings['opencv'] = (
            "grey images, at the defaults of stereo_image_proc or tuned for the scenes' family "
            '(left border padded; settings in evaluation/baselines.py); gaps filled '
            'from the background side on their row, then a 5x5 median')
    settings['time'] = (f'the fastest of {repeats}, from two images to a map as it comes, without '
                        'filling; on scenes cold')
    derived = [result.found.name for result in results if result.found.files.derives_visibility]
    if derived:
        settings['nonocc'] = (f'found from the truth where no mask comes with it '
                              f'({_some(derived)}): its match lies inside the right image, and '
                              'nothing nearer hides it there')
    whole = [result.found.name for result in results if result.found.files.whole_pixel]
    if whole:
        settings['rounded'] = f'{_some(whole)}: the truth has whole pixels'
    return settings


def left_out(results, contestants, skipped):
    """Return the sentences about what is not among some `Result`s."""
    sentences = list(skipped)
    families = list(by_family(results))
    for each in contestants:
        if isinstance(each, OpenCV):
            sentences += [f'{each.name} has no settings for {family}: it takes no part there'
                          for family in families if each.rival(family) is None]
        if isinstance(each, Results):
            missing = [result.found.name for result in results
                       if (each.name, each.starts[0]) not in result.outcomes]
            if missing:
                sentences.append(f'{each.folder} has no result of {_some(missing)}: no means '
                                 f'of {each.name} there')
    return sentences


def subject(ours):
    """Return the profile and the changed parameters of `Ours` in words."""
    changes = ', '.join(f'{name} = {value}' for name, value in sorted(ours.changes.items())
                        if name != 'threads')
    return f'profile {ours.profile}' + (f' with {changes}' if changes else '')


def _told_by(results):
    """Return how many disparities were searched, and who told it."""
    told = {}
    for result in results:
        told.setdefault(result.told_by, []).append(f'{result.found.name}: {result.disparities}')
    return 'searched from 0; how many is told by ' + '; '.join(
        f'{who} ({_some(names)})' for who, names in told.items())


def _some(names):
    """Return names as a list of words, or how many they are."""
    return ', '.join(names) if len(names) <= NAMED else f'{len(names)} scenes'
