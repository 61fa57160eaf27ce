# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Processes that see folders as read-only or small disks, or that nobody knows the user of."""
import shlex
import subprocess

import pytest

READ_ONLY = 'ro'
STRANGER = 54321        # in no list of users
# May read what root may, and write what anybody may.
AS_STRANGER = ['setpriv', f'--reuid={STRANGER}', f'--regid={STRANGER}', '--clear-groups',
               '--inh-caps=-all,+dac_read_search', '--ambient-caps=-all,+dac_read_search']


def mounting(places):
    """Return the words before those of a process for which other file systems are in places."""
    # places: {folder: options of tmpfs}. Skips the test where none may be mounted.
    mounts = ' && '.join(f'mount -t tmpfs -o {options} none {shlex.quote(str(place))}'
                         for place, options in places.items())
    return _allowed(['unshare', '--mount', 'sh', '-c', f'{mounts} && exec "$@"', 'sh'])


def as_stranger():
    """Return the words before those of a process of a user without a name, or skip the test."""
    return _allowed(AS_STRANGER)


def _allowed(words):
    try:
        tried = subprocess.run([*words, 'true'], capture_output=True, text=True)
    except FileNotFoundError as error:
        pytest.skip(f'not on this system: {error.filename}')
    if tried.returncode:
        pytest.skip(f'not allowed here: {tried.stderr.strip()}')
    return words
