# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The folder in which ROS keeps files of its logs, without which it refuses to start."""
import os
from pathlib import Path

from fuzzy_stereo_ros.matching.kernels.cache_folder import make_folder

NO_FILES = '--disable-external-lib-logs'


def log_folder():
    """Return the Path that ROS takes, None where nothing names one."""
    # It looks at the environment alone, not at the system's list of users.
    home = os.environ.get('HOME', '')
    for name, below in (('ROS_LOG_DIR', ''), ('ROS_HOME', 'log'), ('HOME', '.ros/log')):
        start = os.environ.get(name, '')
        if start.startswith('~'):
            start = home and home + start[1:]
        if start:
            return Path(start, below)
    return None


def startable(arguments):
    """
    Return (arguments, remark): those of a process with which ROS starts, in any case.

    remark: a sentence where logs go to no file, else ''.
    """
    folder, reason = log_folder(), 'HOME is not set'
    if NO_FILES in arguments:
        return arguments, ''
    if folder is not None:
        try:
            make_folder(folder)
            return arguments, ''
        except OSError as error:
            reason = f'{folder}: {error.strerror}'
    return [*arguments, '--ros-args', NO_FILES], (
        f'no folder for the files of logs can be written to ({reason}): logs are shown alone; '
        'set ROS_LOG_DIR to a folder that can be')
