# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A figure with rows of equally large pictures, measured in inches; needs matplotlib."""
from typing import NamedTuple

GAP = 0.2           # inches between columns, and around all
HEAD = 0.35         # of the title of all
TITLE = 0.3         # of the title of a picture
LEGEND = 0.25       # of the legend of curves, below their title
BELOW = 0.65        # of what explains colours and axes, below a picture
BAR = 0.1, 0.11     # how far below a picture its bar begins, and how high that is
INSIDE = 0.1        # how much further inside it ends on both sides, for its numbers
TALLEST = 6.0       # of a picture; a taller one becomes narrower than its column
NUMBERS = 0.5       # what numbers beside an axis take of the width of their column


class Strip(NamedTuple):
    """A row of a Sheet in inches: what is drawn, pictures at the top, and around it."""

    drawn: float
    above: float = TITLE
    below: float = BELOW


class Sheet:
    """
    A figure of pictures of one size, in columns, and rows that have room for more.

    figure: of matplotlib, with an even number of pixels each way, as videos need it.
    """

    def __init__(self, columns, picture, strips, dots):
        """Make room: width and height of a picture and Strips, inches; dots: pixels an inch."""
        from matplotlib.figure import Figure

        self._width, self._height = picture
        self._strips = strips
        size = GAP + columns * (self._width + GAP), HEAD + sum(map(sum, strips))
        self.figure = Figure(figsize=[2 * round(side * dots / 2) / dots for side in size],
                             dpi=dots)

    def title(self, text):
        """Write or replace the title of all."""
        self.figure.suptitle(text, y=1 - 0.1 / self.figure.get_figheight(), va='top')

    def picture(self, row, column):
        """Return Axes for a picture."""
        return self._axes(self._left(column), self._top(row), self._width, self._height)

    def curves(self, row, column, columns, count, between):
        """Return Axes for curves, one below the other, as wide as so many columns."""
        left = self._left(column) + NUMBERS
        width = columns * (self._width + GAP) - GAP - NUMBERS
        height = (self._strips[row].drawn - (count - 1) * between) / count
        return [self._axes(left, self._top(row) + place * (height + between), width, height)
                for place in range(count)]

    def bar(self, drawn, row, column, unit, **options):
        """Explain the colours of what is drawn by a bar below a picture."""
        beneath, high = BAR
        top = self._top(row) + self._height + beneath
        place = self._axes(self._left(column) + INSIDE, top, self._width - 2 * INSIDE, high)
        self.figure.colorbar(drawn, cax=place, orientation='horizontal', **options)
        place.tick_params(labelsize='small')
        place.set_xlabel(unit, size='small', labelpad=1)

    def _left(self, column):
        return GAP + column * (self._width + GAP)

    def _top(self, row):
        return HEAD + sum(map(sum, self._strips[:row])) + self._strips[row].above

    def _axes(self, left, top, width, height):
        across, down = self.figure.get_size_inches()
        return self.figure.add_axes((left / across, 1 - (top + height) / down,
                                     width / across, height / down))


def picture_height(width, shape):
    """Return how high, in inches, a picture of (R, C) is in a column of so many inches."""
    return min(width * shape[0] / shape[1], TALLEST)
