# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the system says of a process: what it has worked and what it has in memory."""
import os
from pathlib import Path


class MeasuredProcess:
    """A process that runs, looked at from outside."""

    def __init__(self, identity):
        """Look at nothing yet; identity: its number."""
        self._folder = Path('/proc') / str(identity)

    def seconds(self):
        """Return the s of processor time it has used, in all threads there are and were."""
        fields = (self._folder / 'stat').read_text().rpartition(')')[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf('SC_CLK_TCK')

    def megabytes(self):
        """Return the MB of memory it has in use."""
        return self._pages()[0]

    def own_megabytes(self):
        """Return the MB of memory it has in use and shares with no other."""
        resident, shared = self._pages()
        return resident - shared

    def _pages(self):
        """Return MB (resident, shared)."""
        return [int(pages) * os.sysconf('SC_PAGE_SIZE') / 1e6
                for pages in (self._folder / 'statm').read_text().split()[1:3]]
