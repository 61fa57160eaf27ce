# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The picture of the ablation: error and time of each variant beside the matcher as it is."""
from fuzzy_stereo_ros.benchmarks.picture import column, DEFAULT, OURS, OURS_LIGHT, RIVAL, titled

SCENES, SEQUENCES, TIMES = 'Scenes: mean error', 'Sequences: mean error', 'Scenes: mean time'
ROOM = 2.4      # an error of more than so many times that of the matcher as it is, is cut there


def draw(tables):
    """Return the Figure of the tables of scenes, sequences and times."""
    from matplotlib.figure import Figure

    panels = [('error on scenes [%]', column(titled(tables, SCENES), 'mean of groups'))]
    if any(table.title.startswith(SEQUENCES) for table in tables):
        panels.append(('error on sequences [%]',
                       column(titled(tables, SEQUENCES), 'mean of kinds')))
    errors = len(panels)
    panels.append(('time on scenes, as it is: 1',
                   column(titled(tables, TIMES), 'of that as it is')))
    names = merged([list(found) for _, found in panels])
    figure = Figure(figsize=(4 + 2.4 * len(panels), 1.4 + 0.26 * len(names)),
                    layout='constrained')
    figure.suptitle('Each part of the matcher removed or replaced: lower is better', fontsize=11)
    for number, panel in enumerate(figure.subplots(1, len(panels), sharey=True)):
        title, found = panels[number]
        _draw_bars(panel, names, found, ROOM if number < errors else float('inf'))
        panel.set_title(title, loc='left')
    first = figure.axes[0]
    first.set_yticks(range(len(names)), names)
    first.set_ylim(len(names) - 0.5, -0.5)
    return figure


def merged(lists):
    """Return all names of some lists, each once, behind the one that it follows in its list."""
    names = []
    for other in lists:
        place = 0
        for name in other:
            if name not in names:
                names.insert(place, name)
            place = names.index(name) + 1
    return names


def _draw_bars(panel, names, found, room):
    """Draw a bar for each name that was measured, and a line at the first one."""
    known = {name: found[name] for name in names if found.get(name) is not None}
    usual, longest = known[names[0]], max(known.values())
    end = min(longest, room * usual)
    for name, value in known.items():
        place = names.index(name)
        colour = OURS if name == names[0] else RIVAL if 'tuned' in name else OURS_LIGHT
        panel.barh(place, min(value, end), color=colour)
        cut = value > end
        panel.annotate(f'{value:.2f}' + ' \N{BLACK RIGHT-POINTING TRIANGLE}' * cut,
                       (min(max(value, usual), end), place), xytext=(-3 if cut else 3, 0),
                       textcoords='offset points', va='center', ha='right' if cut else 'left',
                       fontsize=7.5)
    for place, name in enumerate(names):
        if name not in known:
            panel.annotate('not measured', (usual, place), xytext=(3, 0),
                           textcoords='offset points', va='center', fontsize=7.5, color=DEFAULT)
    panel.axvline(usual, color=OURS, linewidth=0.8)
    panel.set_xlim(0, end if end < longest else 1.15 * end)
    panel.tick_params(axis='y', length=0)
