# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The page of an evaluation: one HTML file with all its tables and pictures, for any browser."""
from html import escape

from fuzzy_stereo_ros.evaluation.gallery import error_legend, NOTHING_FOUND, UNKNOWN_GREY
from fuzzy_stereo_ros.evaluation.page_style import STYLE
from fuzzy_stereo_ros.evaluation.report import cell
from fuzzy_stereo_ros.views.pictures import ERROR_LIMIT

BLUE, GREEN, RED = NOTHING_FOUND
LEGEND = (
    '<div class="legend"><span>disparity: blue is far, red is near, dark grey has none</span>'
    f'<span>error: 0 <img alt="colours of errors" src="{error_legend()}"> {ERROR_LIMIT:g} px and '
    f'more</span><span><i class="swatch" style="background:rgb({RED},{GREEN},{BLUE})"></i>a '
    'truth, but no disparity</span><span><i class="swatch" style="background:'
    f'rgb({UNKNOWN_GREY},{UNKNOWN_GREY},{UNKNOWN_GREY})"></i>no truth</span></div>')


def page_of(report, results, gallery, judged):
    """
    Return the text of an HTML page that needs no other file.

    report: a `Report`. results: `Result`s of scenes; gallery: their `Gallery`.
    judged: (name, start) of the contestant whose errors say which scene is best and worst.
    """
    shown = [result for result in results if result.found.name in gallery.shown]
    marked = best_and_worst(shown, judged)
    without = len(results) - len(shown)
    title = escape(report.title)
    parts = [
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f'<title>{title}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n<h1>{title}</h1>']
    if marked:
        parts.append(_section(
            'Best and worst scene', LEGEND,
            f'<p>By the dense error of {escape(judged[0])}: {_limits(shown)}.</p>',
            f'<p>{without} in between have no pictures.</p>'
            if without else '',
            *(_scene(result, gallery, f'{rank}: ') for rank, result in marked.items())))
    elif shown:
        parts.append(_section('Scenes', LEGEND, *(_scene(result, gallery) for result in shown)))
    parts.append(_section('Figures', *(_table(table) for table in report.tables)))
    if report.skipped:
        parts.append(_section('Left out', '<ul>' + ''.join(
            f'<li>{escape(sentence)}</li>' for sentence in report.skipped) + '</ul>'))
    parts.append(_section('How it was measured', _settings(report.settings)))
    others = [result for result in shown if result not in marked.values()] if marked else []
    if others:
        parts.append(_section('The other scenes', *(_scene(result, gallery)
                                                    for result in others)))
    return '\n'.join([*parts, '</body>', '</html>', ''])


def best_and_worst(results, judged):
    """Return {'best' and 'worst': `Result`} by the main error of a contestant, if two have one."""
    errors = {result.found.name: result.main_error(*judged) for result in results}
    ranked = sorted((result for result in results
                     if errors[result.found.name] is not None
                     and errors[result.found.name] == errors[result.found.name]),
                    key=lambda result: errors[result.found.name])
    return {'Best': ranked[0], 'Worst': ranked[-1]} if len(ranked) > 1 else {}


def _limits(results):
    families = {result.found.family: result.found.limit for result in results}
    return ', '.join(f'bad-{limit:g} of {family}' for family, limit in families.items())


def _section(title, *parts):
    return '\n'.join([f'<section>\n<h2>{escape(title)}</h2>', *filter(None, parts), '</section>'])


def _settings(settings):
    return '<dl>' + ''.join(f'<dt>{escape(what)}</dt><dd>{escape(str(how))}</dd>'
                            for what, how in settings.items()) + '</dl>'


def _table(table):
    """Return a `Table` with its title and its note."""
    heads = ''.join(f'<th>{escape(column)}</th>' for column in table.columns)
    rows = ''.join('<tr>' + ''.join(f'<td>{escape(cell(value, table.digits))}</td>'
                                    for value in row) + '</tr>\n' for row in table.rows)
    note = f'<p class="faint">{_emphasised(table.note)}</p>' if table.note else ''
    return (f'<h3>{escape(table.title)}</h3>\n<div class="wide"><table>\n<thead><tr>{heads}</tr>'
            f'</thead>\n<tbody>\n{rows}</tbody>\n</table></div>\n{note}')


def _emphasised(note):
    """Return a note with what Markdown emphasises between stars."""
    parts = escape(note).split('*')
    return ''.join(f'<em>{part}</em>' if place % 2 else part for place, part in enumerate(parts))


def _scene(result, gallery, before=''):
    """Return a scene with its pictures: a column for what is true, one for each contestant."""
    shown = gallery.shown[result.found.name]
    size = f'{result.size[1]}x{result.size[0]}'
    columns = [_column('left image and truth', [], 'left image', shown.left, 'truth', shown.truth)]
    for (name, _), outcome in result.outcomes.items():
        columns.append(_column(name, _figures(result, outcome), f'disparity by {name}',
                               shown.of_matchers[name][0], f'error of {name}',
                               shown.of_matchers[name][1]))
    told = [result.found.layout, size, f'{result.disparities} disparities',
            *(f'figures: {name}' for name in result.masks[:1])]     # none where all left it out
    return (f'<div class="scene">\n<h3>{escape(before + result.found.name)} <span class="faint">'
            f'{escape(", ".join(told))}</span></h3>\n<div class="views">\n'
            + '\n'.join(columns) + '\n</div>\n</div>')


def _column(title, figures, *pictures):
    """Return a heading and two pictures, each with the word that says what it is."""
    images = ''.join(f'<img loading="lazy" alt="{escape(what)}" title="{escape(what)}" '
                     f'src="{uri}">\n' for what, uri in zip(pictures[::2], pictures[1::2]))
    told = '<br>'.join(map(escape, figures))
    return f'<p><strong>{escape(title)}</strong>{told}</p>\n{images}'


def _figures(result, outcome):
    """Return the figures under a contestant's name."""
    limit = result.found.limit
    scores = outcome.scores[result.masks[0]]
    figures = [f'bad-{limit:g}: {scores.filled.bad_dense[limit]:.2f} % dense, '
               f'{scores.found.bad_sparse[limit]:.2f} % sparse',
               f'density {scores.found.density:.1f} %']
    if outcome.milliseconds is not None:
        figures[1] += f', {outcome.milliseconds:.1f} ms'
    return figures
