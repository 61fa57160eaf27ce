# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Whether a saved pair that is matched again comes out the same, bit for bit."""
from dataclasses import fields

from fuzzy_stereo_ros.saved_pairs.versions import versions
import numpy as np


def comparison(saved, config, match):
    """
    Return what a match has in common with the saved one, for JSON.

    saved: SavedPair. config, match: what its pair was matched with now, and what came of it.
    same: whether disparity and confidence are equal to the last bit; where not, `differences`
    tells more. changed: {parameter: value} by which config is not `saved.repeatable`.
    deadline_ms: that it was saved with. versions: which are not those of the saved match.
    """
    differences = {name: _difference(getattr(match, name), getattr(saved.match, name))
                   for name in ('disparity', 'confidence')}
    here = versions()
    return {
        'same': not any(found['pixels'] for found in differences.values()),
        'differences': differences,
        'changed': {parameter.name: getattr(config, parameter.name)
                    for parameter in fields(config)
                    if getattr(config, parameter.name) != getattr(
                        saved.repeatable, parameter.name)},
        'deadline_ms': saved.config.deadline_ms,
        'versions': [name for name in here if saved.versions.get(name) != here[name]],
    }


def is_broken(found):
    """Return whether a comparison found a difference where there should be none."""
    return not found['same'] and not found['changed']


def sentence(found):
    """Return a comparison as a person reads it."""
    if found['same']:
        told = ['the same as saved, bit for bit']
    else:
        told = ['not the same as saved: ' + ', '.join(
            f"{name} differs in {difference['pixels']} pixels (by {difference['largest']:.6g} at "
            f"the most, {difference['valid_in_one']} valid in only one of the two)"
            for name, difference in found['differences'].items() if difference['pixels'])]
    if found['changed']:
        told.append('nothing is promised: other than saved are ' + ', '.join(found['changed']))
    elif not found['same'] and found['deadline_ms'] > 0:
        told.append(f"it was saved with a deadline of {found['deadline_ms']:g} ms and matched "
                    'without one now; only without one are results the same on every run')
    if not found['same'] and found['versions']:
        told.append(f"saved where these were others: {', '.join(found['versions'])}")
    return '\n'.join(told)


def _difference(now, then):
    unlike = now.view(np.uint32) != then.view(np.uint32)
    valid_now, valid_then = np.isfinite(now), np.isfinite(then)
    both = unlike & valid_now & valid_then
    return {'pixels': int(np.count_nonzero(unlike)),
            'largest': float(abs(now[both] - then[both]).max(initial=0)),
            'valid_in_one': int(np.count_nonzero(valid_now != valid_then))}
