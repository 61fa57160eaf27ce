# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the pictures of the benchmarks share: colours, tables to draw from, how they are kept."""
from importlib.util import find_spec
import io

# Blue is ours, orange OpenCV tuned, grey OpenCV as stereo_image_proc sets it.
OURS, OURS_LIGHT = '#0b5fa5', '#74b3e0'
RIVAL, RIVAL_LIGHT = '#c8560b', '#f2a76b'
DEFAULT, DEFAULT_LIGHT = '#7a7a7a', '#bdbdbd'
STYLE = {'svg.fonttype': 'none', 'font.size': 9, 'axes.titlesize': 10, 'axes.axisbelow': True,
         'axes.spines.top': False, 'axes.spines.right': False}


def as_svg(name, draw):
    """
    Return {name: the picture as SVG}, and sentences on what lacks.

    name: of the file. draw: returns a matplotlib Figure; called only where there is matplotlib.
    """
    if find_spec('matplotlib') is None:
        return {}, [f'{name}: there is no matplotlib']
    from matplotlib import rc_context

    stream = io.BytesIO()
    with rc_context({**STYLE, 'svg.hashsalt': name}):
        draw().savefig(stream, format='svg', metadata={'Date': None})
    return {name: stream.getvalue()}, []


def titled(tables, start):
    """Return the one of some tables whose title starts so."""
    return next(table for table in tables if table.title.startswith(start))


def column(table, name):
    """Return {name of a row: what it has in a column}, signed differences as numbers."""
    place = table.columns.index(name)
    return {row[0]: float(row[place]) if isinstance(row[place], str) else row[place]
            for row in table.rows}
