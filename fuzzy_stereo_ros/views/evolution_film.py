# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The film of an evolution: a frame for each generation, drawn as it comes."""
from fuzzy_stereo_ros.views import evolution_curves as curves, evolution_panels as panels
from fuzzy_stereo_ros.views.evolution_record import mutates
from fuzzy_stereo_ros.views.evolution_sheet import GAP, LEGEND, picture_height, Sheet, Strip, TITLE
from fuzzy_stereo_ros.views.video import VideoFile
import numpy as np

DURATION = 10       # seconds of a film
RATES = 1, 10       # fewest and most generations a second
STAY = 2            # seconds that the last one stays
ACROSS = 16.0       # inches of a frame
DOTS = 100          # pixels an inch


class EvolutionFilm:
    """
    A video of an evolution; needs matplotlib.

    rate: generations shown a second. figure: of the frame drawn last, None before the first.
    """

    def __init__(self, path, course):
        """
        Prepare for a Course whose first Snapshot is still to come.

        Raises ValueError where the path is none of a VideoFile.
        """
        self.rate = min(max(round(course.config.generations / DURATION), RATES[0]), RATES[1])
        self._video, self._last = VideoFile(path, self.rate), None
        self._course, self._drawn, self.figure = course, {}, None

    def take(self, snapshot):
        """Append the frame of the Snapshot that the Course took in last."""
        frame = self.frame(snapshot)
        self._video.write(frame)
        self._last = frame

    def close(self):
        """Let the last generation stay for a while, and finish the file; see VideoFile.close."""
        if self._last is not None:
            for _ in range(self.rate * STAY):
                self._video.write(self._last)
        self._video.close()

    def frame(self, snapshot):
        """Return the frame of the Snapshot that the Course took in last: uint8 (R, C, 3) BGR."""
        shown = panels.panels_of(snapshot, self._course)
        if self.figure is None:
            self._begin(shown)
        for name, panel in shown.items():
            self._drawn[name].set_data(np.ma.masked_invalid(panel.values))
            panels.write_title(self._drawn[name].axes, panel.title)
        for place in self._curves:
            place.clear()
        curves.draw_curves(self._curves, self._course)
        self._sheet.title(panels.title_of(self._course))
        self._canvas.draw()
        return np.ascontiguousarray(np.asarray(self._canvas.buffer_rgba())[:, :, 2::-1])

    def _begin(self, shown):
        """
        Draw the first panels and what stays, with what explains their colours.

        Above: image, best, possibility, error. Below: curves, origin, struck, ground truth, and
        where there is nothing for a place, wider curves.
        """
        from matplotlib.backends.backend_agg import FigureCanvasAgg

        course, config = self._course, self._course.config
        across = 3 if course.truth is None else 4
        width = (ACROSS - GAP) / across - GAP
        height = picture_height(width, course.image.shape)
        sheet = self._sheet = Sheet(across, (width, height), [
            Strip(height),
            Strip(max(height, curves.least_height(course)), above=TITLE + LEGEND)], DOTS)
        self.figure = sheet.figure
        self._canvas = FigureCanvasAgg(self.figure)
        above = ['best', 'possibility', 'error']
        below = ['origin', 'struck'] if mutates(config, config.generations) else ['origin']
        if course.truth is not None:
            shown = {**shown, 'truth': panels.Panel(course.truth, 'ground truth; dark is unknown')}
            below.append('truth')
        below = [name for name in below if name in shown]
        panels.draw_image(sheet.picture(0, 0), course)
        places = {name: (0, column) for column, name in enumerate(above, start=1)}
        places |= {name: (1, column) for column, name in enumerate(below, across - len(below))}
        for name, panel in shown.items():
            colours = 'best' if name == 'truth' else name
            self._drawn[name] = panels.draw_panel(
                sheet.picture(*places[name]), colours, panel, config)
            panels.explain(sheet, *places[name], colours, self._drawn[name], config)
        self._curves = curves.places_of(sheet, 1, 0, across - len(below), course)
