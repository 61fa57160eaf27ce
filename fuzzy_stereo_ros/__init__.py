# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Dense stereo by a genetic algorithm with a fuzzy fitness, for Python and for ROS 2."""


def __getattr__(name):
    if name == '__version__':
        from importlib.metadata import version
        return version(__name__)
    raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
