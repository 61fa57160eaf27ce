# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The picture of the demo: image, truth, disparity, confidence and error of a match."""
from fuzzy_stereo_ros.evaluation.scores import ERROR_LIMIT, error_map
from fuzzy_stereo_ros.views.pictures import as_rgb, show_map, write_figure
import numpy as np


def write_panel(path, left, disparity, confidence, truth, *, low, high, title=''):
    """
    Write a picture: left image, truth, disparity, confidence, error, and errors by confidence.

    left: uint8 or uint16 (R, C) or (R, C, 3) BGR. confidence: float (R, C), 0 to 1.
    disparity, truth: float (R, C), pixels, NaN or infinite = invalid, hatched in the picture.
    low, high: pixels, the range of the colours of disparities.
    The suffix of the path sets the format: .png, .pdf or .svg. Needs matplotlib.
    Raises OSError if the file cannot be written.
    """
    from matplotlib.figure import Figure  # takes 0.3 s

    rows, columns = disparity.shape
    figure = Figure(figsize=(13.8, 8.0 * rows / columns + 0.6), dpi=100, layout='compressed')
    figure.suptitle(title)
    places = list(figure.subplots(2, 3).ravel())
    pixels, error = {'cmap': 'turbo', 'vmin': low, 'vmax': high, 'unit': 'px'}, error_map(
        disparity, truth)
    show_map(places[0], as_rgb(left), 'left image')
    show_map(places[1], truth, 'ground truth; hatched is unknown', **pixels)
    show_map(places[2], disparity, 'disparity; hatched is invalid', **pixels)
    show_map(places[3], confidence, 'confidence', cmap='viridis', vmin=0, vmax=1)
    show_map(places[4], error, 'error', cmap='magma', vmin=0, vmax=ERROR_LIMIT, unit='px')
    _show_sparsification(places[5], error, confidence, np.count_nonzero(np.isfinite(truth)))
    write_figure(path, figure)


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
