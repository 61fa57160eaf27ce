# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The versions of what people keep in files, and the sentence for one that is not read here.

A number goes up when an older program would misread the file, or this one an older file.
"""
from fuzzy_stereo_ros.saved_pairs.versions import package_version

PARAMETERS = 1      # names and meanings of the node's parameters
RIGS = 1            # the YAML file of several rigs
SAVED_PAIR = 1      # the folder of a saved pair


def check_format(what, given, known):
    """
    Raise ValueError unless a file has the version that is read here.

    what: the file, as a sentence begins with it. given: its version, None where it has none.
    known: the version that is read.
    """
    if type(given) is int and given == known:
        return
    here = f'fuzzy_stereo_ros {package_version()} reads version {known}'
    if type(given) is int and given > known:
        raise ValueError(f'{what} has version {given} of its format, {here}; '
                         'take a newer fuzzy_stereo_ros')
    told = 'no version' if given is None else f'version {given!r}'
    raise ValueError(f'{what} has {told} of its format, {here}; take the fuzzy_stereo_ros that '
                     'it was made with, or make it anew: CHANGELOG.rst tells what has changed')
