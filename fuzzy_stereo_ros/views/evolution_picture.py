# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
A still picture of an evolution: Figures 4 and 5 of the paper, with what lies between.

Above, the images, the result, and the fitness over the generations; below, a row for each of some
generations: the best chromosome, its possibility, whose genes it has, what mutation did.
"""
import io
from pathlib import Path

from fuzzy_stereo_ros.pairs.whole_files import write_whole
from fuzzy_stereo_ros.views import evolution_curves as curves, evolution_panels as panels
from fuzzy_stereo_ros.views.evolution_sheet import LEGEND, picture_height, Sheet, Strip, TITLE
from fuzzy_stereo_ros.views.pictures import check_panel_suffix
import numpy as np

WIDTH = 3.3         # inches of a picture
DOTS = 100, 200     # fewest and most pixels an inch; between, a pixel is one of the images


def write_evolution(path, course, match):
    """
    Write the picture of an evolution; needs matplotlib.

    path: its suffix chooses the format: .png, .pdf or .svg. course: the Course, at its end.
    match: the Match. Raises ValueError for another suffix, OSError where it cannot be written.
    """
    check_panel_suffix(path)
    content = io.BytesIO()
    evolution_figure(course, match).savefig(content, format=Path(path).suffix[1:])
    write_whole(path, content.getvalue())


def evolution_figure(course, match):
    """Return what `write_evolution` writes, as a Figure of matplotlib."""
    rows = [panels.panels_of(snapshot, course) for snapshot in course.shown()]
    images = 2 if course.truth is None else 3
    across = max(len(rows[0]), images + 1)
    shape = match.disparity.shape
    height = picture_height(WIDTH, shape)
    strips = [Strip(max(height, curves.least_height(course)), above=TITLE + LEGEND),
              *[Strip(height, below=0)] * (len(rows) - 1), Strip(height)]
    sheet = Sheet(across, (WIDTH, height), strips, min(max(shape[1] / WIDTH, DOTS[0]), DOTS[1]))
    sheet.title(panels.title_of(course))
    _show_whole(sheet, across, course, match)
    for at, row in enumerate(rows, start=1):
        for column, (name, panel) in enumerate(row.items()):
            drawn = panels.draw_panel(sheet.picture(at, column), name, panel, course.config)
            if at == len(rows):
                panels.explain(sheet, at, column, name, drawn, course.config)
    return sheet.figure


def _show_whole(sheet, across, course, match):
    """Draw what belongs to no single generation."""
    panels.draw_image(sheet.picture(0, 0), course)
    result = 'result' if course.config.algorithm == 'paper' else 'result, refined'
    if np.isnan(match.disparity).any():
        result += '; dark is invalid'
    maps = [panels.Panel(match.disparity, result)]
    if course.truth is not None:
        maps.insert(0, panels.Panel(course.truth, 'ground truth; dark is unknown'))
    for column, panel in enumerate(maps, start=1):
        drawn = panels.draw_panel(sheet.picture(0, column), 'best', panel, course.config)
        panels.explain(sheet, 0, column, 'best', drawn, course.config)
    free = 1 + len(maps)
    curves.draw_curves(curves.places_of(sheet, 0, free, across - free, course), course)
