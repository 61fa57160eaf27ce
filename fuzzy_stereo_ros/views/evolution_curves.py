# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The curves of an evolution: fitness over the generations and, with truth, the error below."""
import math

FEW = 12            # generations that are marked on a curve one by one
HEIGHT = 1.1        # inches that a curve needs
BETWEEN = 0.4       # inches between two curves
LARGE = 1e4         # fitness from which its power of ten stands in the title
COLOURS = {'best': '#1a7f37', 'mean': '#555555', 'worst': '#b35900'}
ERROR_COLOUR = '#b3261e'


def least_height(course):
    """Return how many inches the curves of a Course need, one below the other."""
    return _count(course) * (HEIGHT + BETWEEN)


def places_of(sheet, row, column, columns, course):
    """Return the Axes of a Sheet for the curves of a Course, as wide as so many columns."""
    return sheet.curves(row, column, columns, _count(course), BETWEEN)


def _count(course):
    return 1 if course.truth is None else 2


def draw_curves(places, course):
    """Draw fitness, and with truth the error of the best, into the Axes of `places_of`."""
    fitness, last = places[0], places[-1]
    largest = max(abs(row.best) for row in course.rows)
    power = math.floor(math.log10(largest)) if largest >= LARGE else 0
    for name, colour in COLOURS.items():
        _draw_curve(fitness, course, name, 10.0**-power, color=colour, label=name)
    scale = 'Eq. 3' if course.config.algorithm == 'paper' else '1 is perfect'
    fitness.set_title(f'fitness ({scale})' + (f' / 1e{power}' if power else ''), size='medium',
                      pad=18)
    fitness.legend(fontsize='small', loc='lower right', bbox_to_anchor=(1, 1), ncols=3,
                   frameon=False, borderaxespad=0.1, handlelength=1.2, columnspacing=1)
    if course.truth is not None:
        fitness.tick_params(labelbottom=False)
        _draw_curve(last, course, 'wrong', color=ERROR_COLOUR)
        last.set_title('best: off by more than 1 px [%]', size='medium')
        last.set_ylim(0, max(1.1 * max(row.wrong for row in course.rows), 1))
    last.set_xlabel('generation', size='small', labelpad=1)


def _draw_curve(place, course, name, factor=1.0, **options):
    numbers = [row.number for row in course.rows]
    place.plot(numbers, [factor * getattr(row, name) for row in course.rows],
               marker='o' if len(numbers) < FEW else None, markersize=4, **options)
    place.xaxis.get_major_locator().set_params(integer=True, min_n_ticks=1)
    place.tick_params(labelsize='small')
    place.set_xlim(-0.5, course.config.generations + 0.5)
    place.grid(alpha=0.3)
