# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The picture of the anytime courses: error and fitness of each start against milliseconds."""
COLUMN, ROW = 3.4, 3.0      # inches of a panel
LEAST = 3                   # panels side by side: the width that the names below take
APART = 1.2                 # times that a point of a curve is later than the one before


def draw(found):
    """Return the Figure of a list of `Courses`."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(COLUMN * max(LEAST, len(found)), 2 * ROW + 1), layout='constrained')
    panels = figure.subplots(2, len(found), squeeze=False)
    for courses, column in zip(found, panels.T):
        for panel, what in zip(column, ('error', 'fitness')):
            for start, stands in courses.stands.items():
                stands = apart(stands)
                panel.plot([stand.milliseconds for stand in stands],
                           [getattr(stand, what) for stand in stands],
                           marker='.', label=start)
            panel.plot(courses.rival.milliseconds, getattr(courses.rival, what), 'k*',
                       label='3WAY')
            panel.set_xscale('log')
        column[0].set_title(courses.scene.path)
        column[0].set_yscale('log')
        column[1].set_xlabel('milliseconds')
    panels[0, 0].set_ylabel('error [%]')
    panels[1, 0].set_ylabel('fitness')
    figure.legend(*panels[0, 0].get_legend_handles_labels(), loc='outside lower center',
                  ncols=3, frameon=False)
    return figure


def apart(stands):
    """Return the first and last `Stand` and some between: more would only make a file large."""
    kept = stands[:1]
    for stand in stands[1:-1]:
        if stand.milliseconds >= APART * kept[-1].milliseconds:
            kept.append(stand)
    return kept + stands[1:][-1:]
