# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Draw images and maps into figures, and write figures, by matplotlib."""
import io
from pathlib import Path

import cv2
from fuzzy_stereo_ros.matching.match import HATCH
from fuzzy_stereo_ros.pairs.image_files import check_suffix, in_eight_bits, write_whole
import numpy as np

PANEL_SUFFIXES = ('.png', '.pdf', '.svg')


def write_figure(path, figure):
    """Write a Figure; the suffix of the path, one of PANEL_SUFFIXES, sets the format."""
    check_suffix(path, PANEL_SUFFIXES)
    content = io.BytesIO()
    figure.savefig(content, format=Path(path).suffix[1:])
    write_whole(path, content.getvalue())


def show_map(place, values, title, unit='', bar=True, **colours):
    """
    Draw an image or a map into Axes and return its AxesImage.

    values: (R, C, 3) RGB; with colours, keywords of imshow, a map: float (R, C), NaN = invalid.
    bar: whether to add a colour bar, with the unit.
    """
    place.set_title(title)
    place.set_axis_off()
    if not colours:
        return place.imshow(values)
    light, dark = ((grey / 255,) * 3 for grey in HATCH)
    place.set_axis_on()
    place.set_xticks([])
    place.set_yticks([])
    place.patch.set(facecolor=light, edgecolor=dark, hatch='/////')
    shown = place.imshow(np.ma.masked_invalid(values), **colours)
    if bar:
        place.figure.colorbar(shown, ax=place, fraction=0.05, pad=0.02).set_label(unit)
    return shown


def as_rgb(image):
    """Return an image, uint8 or uint16, grey or BGR, as uint8 (R, C, 3) RGB."""
    image = in_eight_bits(image)
    return cv2.cvtColor(image, cv2.COLOR_GRAY2RGB if image.ndim == 2 else cv2.COLOR_BGR2RGB)
