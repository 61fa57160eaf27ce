# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the launch files share: arguments from rows of parameters, and how programs start."""
from contextlib import suppress
import sys

from ament_index_python.packages import get_package_prefix, PackageNotFoundError
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration

PACKAGE = 'fuzzy_stereo_ros'
MODULES = {'disparity_node': f'{PACKAGE}.node.disparity_node',
           'managed_disparity_node': f'{PACKAGE}.node.managed_node',
           'simulated_cameras': f'{PACKAGE}.node.simulated_cameras'}
TRUTH = {'true': True, '1': True, 'false': False, '0': False}


def declared(rows, left_out=''):
    """Return a DeclareLaunchArgument for each row; left_out: meaning of an empty one."""
    return [DeclareLaunchArgument(
        row.name, default_value='' if left_out else str(row.default),
        description=row.described() + (left_out and f'; empty: {left_out}')) for row in rows]


def arguments(context, rows):
    """Return {name: value} of the rows' launch arguments; ValueError if one is not allowed."""
    found = {}
    for row in rows:
        value = LaunchConfiguration(row.name).perform(context)
        if isinstance(row.default, bool):
            value = TRUTH.get(value.lower(), value)
        else:
            with suppress(ValueError):      # `checked` rejects it
                value = type(row.default)(value)
        found[row.name] = row.checked(value)
    return found


def installed(package):
    """Return whether ROS finds a package."""
    try:
        get_package_prefix(package)
    except (PackageNotFoundError, OSError):     # OSError without AMENT_PREFIX_PATH
        return False
    return True


def program(executable, *words):
    """Return the arguments of a launch_ros Node that runs one of our executables with words."""
    if installed(PACKAGE):
        return {'package': PACKAGE, 'executable': executable, 'arguments': list(words)}
    # The package is not installed, only on Python's path.
    return {'executable': sys.executable, 'arguments': ['-m', MODULES[executable], *words]}
