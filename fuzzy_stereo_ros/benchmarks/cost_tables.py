# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The tables of times by size, and what they say about growth."""
from fuzzy_stereo_ros.evaluation.report import Table
import numpy as np

LANES = 32          # disparities that the kernels take at once


def race_table(title, found):
    """Return the table of {size: {contestant: milliseconds}}; the last contestant is the rival."""
    names = list(next(iter(found.values())))
    rival = names[-1]
    return Table(title, (
        '', *(f'{name} [ms]' for name in names), *(f'{name}, of {rival}' for name in names[:-1]),
        *(f'{name} [ns a cell]' for name in names)),
        [(size.name, *times.values(), *(times[name] / times[rival] for name in names[:-1]),
          *(1e6 * times[name] / size.cells for name in names))
         for size, times in found.items()], digits=3)


def growth_table(races):
    """
    Return the table of exponents and of steps at multiples of 32.

    races: {what grew: {size: {contestant: milliseconds}}}
    """
    names = list(next(iter(next(iter(races.values())).values())))
    rows = [(f'time over cells, exponent: {what} grow', *(
        exponent([(size.cells, times[name]) for size, times in found.items()])
        for name in names)) for what, found in races.items()]
    for found in races.values():
        rows += [(f'{after.disparities} disparities, to {before.disparities}',
                  *(found[after][name] / found[before][name] for name in names))
                 for before, after in steps(found)]
    return Table('Growth', ('', *names), rows,
                 'Exponent 1: as pixels x disparities, below 1: slower. The other lines are '
                 'ratios of times for one disparity more, on one scene.')


def exponent(points):
    """Return the slope of log time over log cells: float, NaN of fewer than two sizes."""
    if len(points) < 2:
        return float('nan')
    cells, times = np.log(np.transpose(points))
    return float(np.polyfit(cells, times, 1)[0])


def steps(found):
    """Return the pairs of sizes that differ by the one disparity behind a multiple of 32."""
    by_size = {size: size for size in found}
    pairs = [(size._replace(disparities=size.disparities - 1), size) for size in found
             if size.disparities % LANES == 1]
    return [(by_size[before], after) for before, after in pairs if before in by_size]
