# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Paths as rosbags takes them: by URIs that it does not quote, and for ROS 1 by the suffix."""
from pathlib import Path

FILE = 'file://'        # a URI begins with it, and with one more slash


class DatabasePath(type(Path())):
    """
    A path whose text in an f-string, as in f'file:{path}', is that of a URI.

    SQLite would take `#` and `?` for its end, and `%41` for another letter. All else is as usual.
    """

    @property
    def suffix(self):
        """The suffix of a file; none of a folder, which as `x.bag` would count as of ROS 1."""
        return '' if self.is_dir() else super().suffix

    def __format__(self, form):
        return format(self.absolute().as_uri().removeprefix(FILE), form)
