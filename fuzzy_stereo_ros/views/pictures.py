# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A picture of a match: image, disparity, confidence, and with ground truth the error."""
import io
from pathlib import Path

import cv2
from fuzzy_stereo_ros.evaluation.scores import ERROR_LIMIT, error_map
from fuzzy_stereo_ros.matching.colours import INVALID_GREY
from fuzzy_stereo_ros.pairs.image_files import in_eight_bits, write_whole
import numpy as np

PANEL_SUFFIXES = ('.png', '.pdf', '.svg')


def check_panel_suffix(path):
    """Raise ValueError unless the suffix of a path is one of PANEL_SUFFIXES."""
    if Path(path).suffix not in PANEL_SUFFIXES:
        raise ValueError(f"{path} has the suffix '{Path(path).suffix}'; "
                         f"allowed are {', '.join(PANEL_SUFFIXES)}")


def write_panel(path, left, disparity, confidence, truth=None, *, low, high, title=''):
    """
    Write a picture: left image, disparity and confidence; with a truth also truth and error.

    left: uint8 or uint16 (R, C) or (R, C, 3) BGR. confidence: float (R, C), 0 to 1.
    disparity, truth: float (R, C), pixels, NaN or infinite = invalid, dark grey in the picture.
    low, high: pixels, the range of the colours of disparities.
    The suffix of the path sets the format: .png, .pdf or .svg. Needs matplotlib.
    Raises ValueError for another suffix, OSError if the file cannot be written.
    """
    from matplotlib.figure import Figure  # takes 0.3 s

    check_panel_suffix(path)
    down, across = (1, 3) if truth is None else (2, 3)
    rows, columns = disparity.shape
    figure = Figure(figsize=(4.6 * across, 4.0 * down * rows / columns + 0.6), dpi=100,
                    layout='compressed')
    figure.suptitle(title)
    places = list(figure.subplots(down, across, squeeze=False).ravel())
    pixels = {'cmap': 'turbo', 'vmin': low, 'vmax': high, 'unit': 'px'}
    show_map(places.pop(0), as_rgb(left), 'left image')
    if truth is not None:
        show_map(places.pop(0), truth, 'ground truth', **pixels)
    show_map(places.pop(0), disparity, 'disparity', **pixels)
    show_map(places.pop(0), confidence, 'confidence', cmap='viridis', vmin=0, vmax=1)
    if truth is not None:
        error = error_map(disparity, truth)
        show_map(places.pop(0), error, 'error', cmap='magma', vmin=0, vmax=ERROR_LIMIT, unit='px')
        _show_sparsification(places.pop(0), error, confidence,
                             np.count_nonzero(np.isfinite(truth)))
    write_figure(path, figure)


def write_figure(path, figure):
    """Write a Figure; the suffix of the path sets the format."""
    check_panel_suffix(path)
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
    grey = (INVALID_GREY / 255,) * 3
    place.set_axis_on()
    place.set_xticks([])
    place.set_yticks([])
    place.set_facecolor(grey)
    shown = place.imshow(np.ma.masked_invalid(values), **colours)
    if bar:
        place.figure.colorbar(shown, ax=place, fraction=0.05, pad=0.02).set_label(unit)
    return shown


def _show_sparsification(place, error, confidence, known_pixels):
    """Draw the error that remains while the pixels of least confidence are removed."""
    place.set_title('sparsification by confidence')
    place.set_xlabel('pixels with ground truth, the most confident first [%]')
    place.set_ylabel('of them off by more than 1 px [%]')
    found = np.isfinite(error)
    wrong = error[found][np.argsort(-confidence[found], kind='stable')] > 1
    kept = np.arange(1, wrong.size + 1)
    start = max(1, wrong.size // 50)
    place.plot((100 * kept / known_pixels)[start:], (100 * np.cumsum(wrong) / kept)[start:])
    place.set_xlim(0, 100)
    place.set_ylim(bottom=0)
    place.grid(alpha=0.3)


def as_rgb(image):
    """Return an image, uint8 or uint16, grey or BGR, as uint8 (R, C, 3) RGB."""
    image = in_eight_bits(image)
    return cv2.cvtColor(image, cv2.COLOR_GRAY2RGB if image.ndim == 2 else cv2.COLOR_BGR2RGB)
