# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the still and the film of an evolution share: maps, colours, titles and legends."""
from typing import NamedTuple

from fuzzy_stereo_ros.evaluation.scores import error_map
from fuzzy_stereo_ros.views.evolution_record import ALIKE, FIRST, MUTATED, mutates, SECOND
from fuzzy_stereo_ros.views.pictures import as_rgb, ERROR_LIMIT, show_map
import numpy as np

ORIGIN_COLOURS = {ALIKE: '#d9d9d9', FIRST: '#3b6fb6', SECOND: '#f2a93b', MUTATED: '#d62768'}
ORIGIN_WORDS = {
    'paper': {FIRST: 'first parent', SECOND: 'second parent', MUTATED: 'mutation'},
    'realtime': {ALIKE: 'alike in all', FIRST: 'kept, others differ',
                 SECOND: 'from the other seed'},
    'quality': {ALIKE: 'alike in all', FIRST: 'kept, others differ',
                SECOND: 'from mutants and others'}}
NOTHING, UNCOUNTED = '#ffffff', '#8a8a8a'     # no genes to tell of; no ground truth


class Panel(NamedTuple):
    """A map of a generation: float (R, C), NaN where there is nothing, and what stands above."""

    values: np.ndarray
    title: str


def panels_of(snapshot, course):
    """Return {name: Panel} of a Snapshot that the Course took in."""
    config, nothing = course.config, np.full(snapshot.best.shape, np.nan)
    generation = f'generation {snapshot.number}' if snapshot.number else 'initial population'
    panels = {'best': Panel(snapshot.best, f'{generation}: best chromosome')}
    if course.truth is not None:
        counted = True if course.mask is None else course.mask
        panels['error'] = Panel(
            np.where(counted, error_map(snapshot.best, course.truth), np.nan),
            f'{course.rows[snapshot.number].wrong:.2f} % off by more than 1 px')
    panels['possibility'] = Panel(
        snapshot.possibility, f'its possibility, mean {snapshot.possibility.mean():.4f}')
    if config.generations > 0:
        panels['origin'] = Panel(nothing if snapshot.origin is None else snapshot.origin,
                                 _origin_title(snapshot, config))
    if mutates(config, config.generations):
        panels['struck'] = Panel(100 * snapshot.struck, 'where mutation struck') \
            if mutates(config, snapshot.number) else Panel(nothing, 'no mutation yet')
    return panels


def _origin_title(snapshot, config):
    """Return whose genes the origins of a Snapshot are."""
    if snapshot.origin is None:
        return 'no parents yet'
    if config.algorithm != 'paper':
        return f'its genes, {100 * np.isin(snapshot.origin, (SECOND, MUTATED)).mean():.2f} % new'
    return 'parents of the fittest child, ' + (
        'the new best' if snapshot.is_best else 'not the best')


def draw_panel(place, name, panel, config):
    """Draw a Panel into its place, and return what was drawn."""
    drawn = show_map(place, panel.values, '', bar=False, **_colours(name, config))
    write_title(place, panel.title)
    if name in ('origin', 'struck'):
        place.set_facecolor(NOTHING)
    if name == 'error':
        place.set_facecolor(UNCOUNTED)
    return drawn


def write_title(place, text):
    """Write what stands above a picture."""
    place.set_title(text, size='medium')


def draw_image(place, course):
    """Draw the reference image."""
    show_map(place, as_rgb(course.image), '')
    write_title(place, f'{course.config.reference} image, the reference')


def _colours(name, config):
    """Return the keywords of `show_map` for the panel of this name."""
    if name == 'best':
        lowest = config.min_disparity
        return {'cmap': 'turbo', 'vmin': lowest,
                'vmax': lowest + max(config.disparities - 1, 1)}
    if name == 'error':
        return {'cmap': 'magma', 'vmin': 0, 'vmax': ERROR_LIMIT}
    if name == 'possibility':
        return {'cmap': 'viridis', 'vmin': 0, 'vmax': 1}
    if name == 'struck':
        # The paper's patches fall where they may: few cells are struck in half of the rate.
        top = max(50 * config.mutation_rate, 1) if config.algorithm == 'paper' else 100
        return {'cmap': 'magma', 'vmin': 0, 'vmax': top}
    from matplotlib.colors import ListedColormap

    colours = [ORIGIN_COLOURS[code] for code in sorted(ORIGIN_COLOURS)]
    return {'cmap': ListedColormap(colours), 'vmin': -0.5, 'vmax': len(colours) - 0.5,
            'interpolation': 'nearest'}


def explain(sheet, row, column, name, drawn, config):
    """Put below a panel of a Sheet what its colours mean."""
    if name == 'origin':
        _explain_origins(drawn.axes, config)
    elif name == 'struck':
        extend = 'max' if config.algorithm == 'paper' else 'neither'
        sheet.bar(drawn, row, column, '% of the children', extend=extend)
    elif name == 'error':
        sheet.bar(drawn, row, column, 'error in px; grey does not count', extend='max')
    else:
        sheet.bar(drawn, row, column, 'px' if name == 'best' else '')


def _explain_origins(place, config):
    from matplotlib.patches import Patch

    words = dict(ORIGIN_WORDS[config.algorithm])
    if not mutates(config, config.generations):
        words.pop(MUTATED, None)
    place.legend(handles=[Patch(color=ORIGIN_COLOURS[code], label=word)
                          for code, word in words.items()],
                 ncols=2, loc='upper center', bbox_to_anchor=(0.5, 0), borderaxespad=0.5,
                 fontsize='small', frameon=False, handlelength=1, columnspacing=1)


def title_of(course):
    """Return what is evolved, and how far it has come, in one line."""
    config, lowest = course.config, course.config.min_disparity
    most = 'at most ' if config.algorithm == 'realtime' else ''     # which converges
    return (f'generation {course.rows[-1].number} of {most}{config.generations}, '
            f'profile {config.algorithm}, population {config.population}, disparities {lowest} to '
            f'{lowest + config.disparities - 1} px')
