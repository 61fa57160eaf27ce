# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The pictures of the benchmarks, drawn from the tables of their reports, as SVG."""
from importlib.util import find_spec
import io

# Blue is ours, orange OpenCV tuned, grey OpenCV as stereo_image_proc sets it.
OURS, OURS_LIGHT = '#0b5fa5', '#74b3e0'
TUNED, TUNED_LIGHT = '#c8560b', '#f2a76b'
DEFAULT, DEFAULT_LIGHT = '#7a7a7a', '#bdbdbd'
STYLE = {'svg.fonttype': 'none', 'font.size': 9, 'axes.titlesize': 10, 'axes.axisbelow': True,
         'axes.spines.top': False, 'axes.spines.right': False}
# At their defaults SGBM, 3WAY and HH4 differ by less than a bar shows.
BARS = {'ours': OURS, 'ours, profile quality': OURS_LIGHT, '3WAY tuned': TUNED_LIGHT,
        'HH4 tuned, 0 refused': TUNED, 'SGBM default': DEFAULT_LIGHT, 'BM default': DEFAULT}
BAR = 0.14          # width; 1 is the distance of two groups
LEAST = 7.5         # inches that the names below a picture take
LINES = {'ours, cold': (OURS_LIGHT, 's-'), 'ours, warm': (OURS, 'o-'), '3WAY': (TUNED, '^-')}
MARKS = {'3WAY': (TUNED, '^', 'OpenCV 3WAY tuned'),
         'cold': (OURS_LIGHT, 's', 'ours, cold: each frame alone'),
         'warm': (OURS, 'o', 'ours, warm: with the frame before')}
ROOM = 2.4          # a bar of more than so many times that of the matcher as it is, is cut there
APART = 1.2         # times that a point of a curve is later than the one before


def as_svg(name, draw):
    """
    Return {name: the picture as SVG}, and sentences on what is missing.

    name: of the file. draw: returns a matplotlib Figure; called only where there is matplotlib.
    """
    if find_spec('matplotlib') is None:
        return {}, [f'{name}: matplotlib is not installed']
    from matplotlib import rc_context

    stream = io.BytesIO()
    with rc_context({**STYLE, 'svg.hashsalt': name}):
        draw().savefig(stream, format='svg', metadata={'Date': None})
    return {name: stream.getvalue()}, []


def titled(tables, start):
    """Return the one of some tables whose title starts so."""
    return next(table for table in tables if table.title.startswith(start))


def column(table, name):
    """Return {name of a row: its cell in a column}."""
    place = table.columns.index(name)
    return {row[0]: row[place] for row in table.rows}


def _figure(width, height, title=''):
    """Return an empty Figure; width, height: inches."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout='constrained')
    if title:
        figure.suptitle(title, fontsize=11)
    return figure


def _legend(figure):
    """Explain below a Figure what the marks of its first panel are."""
    figure.legend(*figure.axes[0].get_legend_handles_labels(), loc='outside lower center', ncols=3,
                  frameon=False)


def draw_accuracy(tables):
    """Return the Figure of the table of groups: bars of error, ours beside OpenCV's."""
    table = titled(tables, 'Groups')
    groups = [row[0] for row in table.rows]
    figure = _figure(max(LEAST, 1.65 * len(groups)), 4.0)
    panel = figure.subplots()
    for place, (name, colour) in enumerate(BARS.items()):
        errors = column(table, name)
        known = [number for number, group in enumerate(groups) if errors[group] is not None]
        bars = panel.bar([number + (place - (len(BARS) - 1) / 2) * BAR for number in known],
                         [errors[groups[number]] for number in known], BAR, color=colour,
                         label=name if name.startswith('ours') else f'OpenCV {name}')
        panel.bar_label(bars, fmt='%.1f', fontsize=6.5, padding=1)
    panel.set_xticks(range(len(groups)), [group.replace(' (', '\n(') for group in groups])
    panel.set_xlim(-0.6, len(groups) - 0.4)
    panel.tick_params(axis='x', length=0)
    panel.set_ylabel('pixels off by more than 1 px (KITTI: 3 px) [%]')
    panel.grid(axis='y', alpha=0.3)
    panel.set_title('Error by group of scenes, lower is better', loc='left')
    _legend(figure)
    return figure


def draw_warm(tables):
    """Return the Figure of the table of error and flicker: a line leads from cold to warm."""
    table = titled(tables, 'Error and flicker')
    kinds = [row[0] for row in table.rows]
    figure = _figure(8.4, 1.7 + 0.24 * len(kinds), 'With and without the frame before: lower is '
                     'better')
    panels = figure.subplots(1, 2, sharey=True)
    for panel, (title, heading) in zip(panels, {
            'error [% of pixels]': '{}', 'flicker [% of pixels that change]': 'flicker, {}'
            }.items()):
        figures = {name: column(table, heading.format(name)) for name in MARKS}
        for place, kind in enumerate(kinds):
            panel.plot([figures['cold'][kind], figures['warm'][kind]], [place, place], '-',
                       color=OURS_LIGHT, linewidth=2.5)
        for name, (colour, mark, label) in MARKS.items():
            panel.plot([figures[name][kind] for kind in kinds], range(len(kinds)), mark,
                       color=colour, markersize=5.5, label=label)
        panel.set_title(title, loc='left')
        panel.grid(alpha=0.3)
        panel.set_xlim(left=-1)
    panels[0].set_yticks(range(len(kinds)), kinds)
    panels[0].set_ylim(len(kinds) - 0.5, -0.5)
    _legend(figure)
    return figure


def draw_cost(tables):
    """Return the Figure of the tables of times over pixels and over disparities."""
    figure = _figure(8.4, 3.9)
    panels = figure.subplots(1, 2, sharey=True)
    for panel, what in zip(panels, ('pixels', 'disparities')):
        table = titled(tables, f'Over {what}')
        sizes = {row[0]: sized(row[0]) for row in table.rows}
        for name, (colour, style) in LINES.items():
            times = column(table, f'{name} [ms]')
            panel.plot([size[what] for size in sizes.values()], list(times.values()), style,
                       color=colour, markersize=4,
                       label=name if name.startswith('ours') else f'OpenCV {name} tuned')
        panel.set_xscale('log')
        panel.set_yscale('log')
        panel.grid(alpha=0.3)
        panel.set_title(table.title, loc='left')
        panel.set_xlabel(what)
        panel.minorticks_off()
        shown = {size[what]: size['frame'] if what == 'pixels' else size[what]
                 for size in sizes.values() if what == 'pixels' or size[what] % 16 == 0}
        panel.set_xticks(list(shown), list(shown.values()))
    panels[0].yaxis.set_major_formatter('{x:g}')
    panels[0].set_ylabel('milliseconds a pair, one thread')
    _legend(figure)
    return figure


def sized(name):
    """Return the frame, the pixels and the disparities of a size as tables name it."""
    columns, rows, disparities = map(int, name.split('x'))
    return {'frame': f'{columns}x{rows}', 'pixels': rows * columns, 'disparities': disparities}


def draw_anytime(found):
    """Return the Figure of a list of `Curves`: error and fitness against milliseconds."""
    figure = _figure(3.4 * max(3, len(found)), 7)
    panels = figure.subplots(2, len(found), squeeze=False)
    for curves, pair in zip(found, panels.T):
        for panel, what in zip(pair, ('error', 'fitness')):
            for start, samples in curves.samples.items():
                samples = apart(samples)
                panel.plot([one.milliseconds for one in samples],
                           [getattr(one, what) for one in samples], marker='.', label=start)
            panel.plot(curves.baseline.milliseconds, getattr(curves.baseline, what), 'k*',
                       label='3WAY')
            panel.set_xscale('log')
        pair[0].set_title(curves.scene.path)
        pair[0].set_yscale('log')
        pair[1].set_xlabel('milliseconds')
    panels[0, 0].set_ylabel('error [%]')
    panels[1, 0].set_ylabel('fitness')
    _legend(figure)
    return figure


def apart(samples):
    """Return the first and last sample and some between: more would only make a file large."""
    kept = samples[:1]
    for sample in samples[1:-1]:
        if sample.milliseconds >= APART * kept[-1].milliseconds:
            kept.append(sample)
    return kept + samples[1:][-1:]


def draw_ablation(tables):
    """Return the Figure of the tables of scenes, sequences and times: a bar for each variant."""
    panels = [(title, column(titled(tables, start), heading), room)
              for title, start, heading, room in (
                  ('error on scenes [%]', 'Scenes: mean error', 'mean of groups', ROOM),
                  ('error on sequences [%]', 'Sequences: mean error', 'mean of kinds', ROOM),
                  ('time on scenes, as it is: 1', 'Scenes: mean time', 'of that as it is',
                   float('inf')))
              if any(table.title.startswith(start) for table in tables)]
    names = list(panels[0][1])
    for _, figures, _ in panels:        # the others follow the matcher as it is
        names[1:1] = [name for name in figures if name not in names]
    figure = _figure(4 + 2.4 * len(panels), 1.4 + 0.26 * len(names),
                     'Each part of the matcher removed or replaced: lower is better')
    for panel, (title, figures, room) in zip(figure.subplots(1, len(panels), sharey=True), panels):
        _draw_bars(panel, names, figures, room)
        panel.set_title(title, loc='left')
    figure.axes[0].set_yticks(range(len(names)), names)
    figure.axes[0].set_ylim(len(names) - 0.5, -0.5)
    return figure


def _draw_bars(panel, names, figures, room):
    """Draw a bar for each name that was measured, and a line at the first one."""
    usual, longest = figures[names[0]], max(figures.values())
    end = min(longest, room * usual)
    for place, name in enumerate(names):
        value, where, side, word = figures.get(name), usual, 'left', 'not measured'
        if value is not None:
            cut = value > end
            panel.barh(place, min(value, end), color=OURS if place == 0 else
                       TUNED if 'tuned' in name else OURS_LIGHT)
            where, side = (end, 'right') if cut else (max(value, usual), 'left')
            word = f'{value:.2f}' + ' \N{BLACK RIGHT-POINTING TRIANGLE}' * cut
        panel.annotate(word, (where, place), xytext=(3 if side == 'left' else -3, 0),
                       textcoords='offset points', va='center', ha=side, fontsize=7.5,
                       color=DEFAULT if value is None else 'black')
    panel.axvline(usual, color=OURS, linewidth=0.8)
    panel.set_xlim(0, end if end < longest else 1.15 * end)
    panel.tick_params(axis='y', length=0)
