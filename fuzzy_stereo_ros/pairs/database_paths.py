# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Paths of .db3 files as rosbags opens them, by a URI that it does not quote."""
import os
from pathlib import Path
from urllib.parse import quote


class DatabasePath(type(Path())):
    """
    A path whose text in an f-string, as in f'file:{path}', is that of a URI.

    SQLite would take `#` and `?` for its end, and `%41` for another letter. All else is as usual.
    """

    def __format__(self, form):
        return format(quote(os.fsencode(self)), form)
