# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What was lost although nothing was wrong with it, as lines for the log: none goes untold."""

# By what the keys of counts, as of `reports.counts_of`, begin with.
KINDS = {
    'pairs dropped': 'newer ones came before they were matched, see scale and disparity_range',
    'unmatched ': 'the other topics had not come with their stamps when newer ones came, the '
                  'stamps went back or nobody listened any more, see queue_size and '
                  'approximate_sync',
    'lost ': 'they were sent and never arrived, see input_qos and config/fastdds.xml',
}


class Losses:
    """Lets the first loss of a kind through at once, then what came since, once a period."""

    def __init__(self, period=60.0):
        """Begin with nothing lost; period: s, long, as a busy node drops pairs all the time."""
        self._period = period
        self._told, self._when = {}, {}

    def lines(self, now, counts, last=False):
        """
        Return the lines to log at a time in s; their numbers add up to the counts in the end.

        counts: {key: number}, as of `counts_of`. last: tell all that was not told yet.
        """
        found = []
        for kind, reason in KINDS.items():
            lost = {key: count - self._told.get(key, 0) for key, count in counts.items()
                    if key.startswith(kind) and count > self._told.get(key, 0)}
            waits = kind in self._when and now - self._when[kind] < self._period
            if lost and (last or not waits):
                self._when[kind] = now
                self._told.update({key: counts[key] for key in lost})
                numbers = ', '.join(f'{key} {number}' for key, number in lost.items())
                found.append(f'since such a line: {numbers}; {reason}')
        return found
