# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The picture of the warm start: error and flicker by kind of sequence, cold, warm and 3WAY."""
from fuzzy_stereo_ros.benchmarks.picture import column, OURS, OURS_LIGHT, RIVAL, titled

MARKS = {'3WAY': (RIVAL, '^', 'OpenCV 3WAY tuned'),
         'cold': (OURS_LIGHT, 's', 'ours, cold: each frame alone'),
         'warm': (OURS, 'o', 'ours, warm: with the frame before')}
PANELS = {'error [% of pixels]': '{}', 'flicker [% of pixels that change]': 'flicker, {}'}


def draw(tables):
    """Return the Figure of the table of error and flicker: a line leads from cold to warm."""
    from matplotlib.figure import Figure

    table = titled(tables, 'Error and flicker')
    kinds = [row[0] for row in table.rows]
    figure = Figure(figsize=(8.4, 1.7 + 0.24 * len(kinds)), layout='constrained')
    figure.suptitle('With and without the frame before: lower is better', fontsize=11)
    panels = figure.subplots(1, 2, sharey=True)
    for panel, (title, heading) in zip(panels, PANELS.items()):
        found = {name: column(table, heading.format(name)) for name in MARKS}
        for place, kind in enumerate(kinds):
            panel.plot([found['cold'][kind], found['warm'][kind]], [place, place], '-',
                       color=OURS_LIGHT, linewidth=2.5)
        for name, (colour, mark, label) in MARKS.items():
            panel.plot([found[name][kind] for kind in kinds], range(len(kinds)), mark,
                       color=colour, markersize=5.5, label=label)
        panel.set_title(title, loc='left')
        panel.grid(alpha=0.3)
        panel.set_xlim(left=-1)
    panels[0].set_yticks(range(len(kinds)), kinds)
    panels[0].set_ylim(len(kinds) - 0.5, -0.5)
    figure.legend(*panels[0].get_legend_handles_labels(), loc='outside lower center', ncols=3,
                  frameon=False)
    return figure
