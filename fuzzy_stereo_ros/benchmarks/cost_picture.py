# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The picture of cost: milliseconds over pixels and over disparities, ours beside 3WAY."""
from fuzzy_stereo_ros.benchmarks.picture import column, OURS, OURS_LIGHT, RIVAL, titled

LINES = {'ours, cold': (OURS_LIGHT, 's-'), 'ours, warm': (OURS, 'o-'), '3WAY': (RIVAL, '^-')}


def draw(tables):
    """Return the Figure of the tables of times over pixels and over disparities."""
    from matplotlib.figure import Figure
    from matplotlib.ticker import LogLocator, NullFormatter, NullLocator, ScalarFormatter

    figure = Figure(figsize=(8.4, 3.9), layout='constrained')
    panels = figure.subplots(1, 2, sharey=True)
    for panel, start, what in zip(panels, ('Over pixels', 'Over disparities'),
                                  ('pixels', 'disparities')):
        table = titled(tables, start)
        sizes = {row[0]: sized(row[0]) for row in table.rows}
        for name, (colour, style) in LINES.items():
            times = column(table, f'{name} [ms]')
            panel.plot([size[what] for size in sizes.values()],
                       [times[size] for size in sizes], style, color=colour, markersize=4,
                       label=name if name.startswith('ours') else f'OpenCV {name} tuned')
        panel.set_xscale('log')
        panel.set_yscale('log')
        panel.grid(alpha=0.3)
        panel.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        panel.yaxis.set_major_formatter(ScalarFormatter())
        panel.yaxis.set_minor_formatter(NullFormatter())
        panel.xaxis.set_minor_locator(NullLocator())
        panel.set_title(table.title, loc='left')
        panel.set_xlabel(what)
    shown = {sized(row[0])['pixels']: row[0].rpartition('x')[0]
             for row in titled(tables, 'Over pixels').rows}
    panels[0].set_xticks(list(shown), list(shown.values()))
    powers = sorted({sized(row[0])['disparities'] for row in titled(tables, 'Over disp').rows
                     if sized(row[0])['disparities'] % 16 == 0})
    panels[1].set_xticks(powers, powers)
    panels[0].set_ylabel('milliseconds a pair, one thread')
    figure.legend(*panels[0].get_legend_handles_labels(), loc='outside lower center', ncols=3,
                  frameon=False)
    return figure


def sized(name):
    """Return {'pixels': number, 'disparities': number} of a size as tables name it."""
    columns, rows, disparities = map(int, name.split('x'))
    return {'pixels': rows * columns, 'disparities': disparities}
