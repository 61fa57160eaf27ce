# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Whether a saved pair that is matched again comes out the same, bit for bit.

And what it is matched on, as far as that may decide about the bits of a result.
"""
from dataclasses import fields
from importlib.metadata import PackageNotFoundError
import platform

import cv2
import fuzzy_stereo_ros
import numba
from numba.core.registry import cpu_target
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


def versions():
    """
    Return {what: str}: versions, platform, and the processor that numba compiles for.

    processor_features: names of instruction sets, separated by blanks.
    """
    try:
        version = fuzzy_stereo_ros.__version__
    except PackageNotFoundError:    # a source tree that was never installed
        version = 'unknown'
    _, processor, features = cpu_target.target_context.codegen().magic_tuple()
    return {
        'fuzzy_stereo_ros': version,
        'python': platform.python_version(),
        'numpy': np.__version__,
        'numba': numba.__version__,
        'opencv': cv2.__version__,
        'platform': _platform(),
        'processor': processor,
        'processor_features': ' '.join(
            name[1:] for name in features.split(',') if name.startswith('+')),
    }


def _platform():
    """Return what platform.platform() says, which starts a process for a part it leaves out."""
    name = f'{platform.system()}-{platform.release()}-{platform.machine()}'
    library = ''.join(platform.libc_ver())
    return f'{name}-with-{library}' if library else name
