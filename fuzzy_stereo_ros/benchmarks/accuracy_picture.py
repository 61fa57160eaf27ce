# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The picture of accuracy: bars of error by group of scenes, ours beside OpenCV's."""
from fuzzy_stereo_ros.benchmarks.picture import (
    column, DEFAULT, DEFAULT_LIGHT, OURS, OURS_LIGHT, RIVAL, RIVAL_LIGHT, titled)

# At their defaults SGBM, 3WAY and HH4 differ by less than a bar shows.
SHOWN = {'ours': OURS, 'ours, profile quality': OURS_LIGHT, '3WAY tuned': RIVAL_LIGHT,
         'HH4 tuned, 0 refused': RIVAL, 'SGBM default': DEFAULT_LIGHT, 'BM default': DEFAULT}
WIDTH = 0.14        # of a bar; 1 is the distance of two groups
LEAST = 7.5         # inches that the names below take


def draw(tables):
    """Return the Figure of the table of groups."""
    from matplotlib.figure import Figure

    table = titled(tables, 'Groups')
    groups = [row[0] for row in table.rows]
    figure = Figure(figsize=(max(LEAST, 1.65 * len(groups)), 4.0), layout='constrained')
    panel = figure.subplots()
    for place, (name, colour) in enumerate(SHOWN.items()):
        errors = column(table, name)
        known = [number for number, group in enumerate(groups) if errors[group] is not None]
        bars = panel.bar([number + (place - (len(SHOWN) - 1) / 2) * WIDTH for number in known],
                         [errors[groups[number]] for number in known], WIDTH, color=colour,
                         label=name if name.startswith('ours') else f'OpenCV {name}')
        panel.bar_label(bars, fmt='%.1f', fontsize=6.5, padding=1)
    panel.set_xticks(range(len(groups)), [group.replace(' (', '\n(') for group in groups])
    panel.set_xlim(-0.6, len(groups) - 0.4)
    panel.tick_params(axis='x', length=0)
    panel.set_ylabel('pixels off by more than 1 px (KITTI: 3 px) [%]')
    panel.grid(axis='y', alpha=0.3)
    panel.set_title('Error by group of scenes, lower is better', loc='left')
    figure.legend(loc='outside lower center', ncols=3, frameon=False)
    return figure
