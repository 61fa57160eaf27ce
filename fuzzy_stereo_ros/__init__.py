# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Dense stereo by a genetic algorithm with a fuzzy fitness, for Python and for ROS 2."""

__all__ = ['Match', 'MatcherConfig', 'StereoMatcher']


def __getattr__(name):
    """Import the matcher, which takes a second, and look for the version when they are used."""
    if name in __all__:
        from fuzzy_stereo_ros import matching
        return getattr(matching, name)
    if name == '__version__':
        from importlib.metadata import PackageNotFoundError, version
        try:
            return version(__name__)
        except PackageNotFoundError:
            return 'unknown'    # the package is not installed
    raise AttributeError(f'module {__name__!r} has no attribute {name!r}')


def __dir__():
    return [*globals(), *__all__]
