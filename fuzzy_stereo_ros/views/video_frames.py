# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Frames of videos: a matched pair side by side, and pictures fitted into another size."""
import cv2
from fuzzy_stereo_ros.pairs.brightness import in_eight_bits
from fuzzy_stereo_ros.views.pictures import colour_disparity, INVALID_GREY
import numpy as np

PANEL = 320, 1280       # narrowest and widest picture beside another, px
HEAD = 52               # height of the titles above, px
MARGIN = 8              # px between what stands in the head
BAR = 10                # height of a bar of colours, px
LETTERS = 0.5           # size of the letters, as OpenCV counts it
GREY, WHITE = (32, 32, 32), (235, 235, 235)


def side_by_side(matched, low, high):
    """
    Return the reference image, the disparity and the confidence of a Matched beside each other.

    Titles stand above, with bars that explain the colours. The picture is uint8 (R, C, 3) BGR.
    low, high: px, the ends of the disparities' colours.
    """
    pair, match, config = matched.pair, matched.match, matched.config
    image = in_eight_bits(getattr(pair, config.reference))
    confidence = cv2.convertScaleAbs(match.confidence, alpha=255)
    panels = [
        (image if image.ndim == 3 else cv2.cvtColor(image, cv2.COLOR_GRAY2BGR),
         f'{config.reference} image', f'stamp {pair.stamp / 1e9:.3f} s', None, None),
        (colour_disparity(match.disparity, low, high), 'disparity [px], grey is invalid',
         f'{low:g}', f'{high:g}', cv2.COLORMAP_TURBO),
        (cv2.applyColorMap(confidence, cv2.COLORMAP_VIRIDIS), 'confidence', '0', '1',
         cv2.COLORMAP_VIRIDIS)]
    return np.hstack([_headed(_sized(picture), *words) for picture, *words in panels])


def letterboxed(picture, rows, columns):
    """
    Return a picture of another size, uint8 (rows, columns, 3), its proportions kept.

    One that is smaller by a pixel at the most is not made larger, which would blur it. What
    remains free is dark.
    """
    if picture.shape[:2] == (rows, columns):
        return picture
    scale = min(rows / picture.shape[0], columns / picture.shape[1])
    whole = np.full((rows, columns, 3), INVALID_GREY, np.uint8)
    if not (0 <= rows - picture.shape[0] <= 1 and 0 <= columns - picture.shape[1] <= 1):
        size = [max(1, min(round(side * scale), most))
                for side, most in zip(picture.shape[1::-1], (columns, rows))]
        picture = cv2.resize(picture, size, interpolation=cv2.INTER_AREA)
    top, left = ((most - side) // 2 for most, side in zip((rows, columns), picture.shape))
    whole[top:top + picture.shape[0], left:left + picture.shape[1]] = picture
    return whole


def _sized(picture):
    """Return a picture wide enough for its title, and not too wide to stand beside two others."""
    narrowest, widest = PANEL
    rows, columns = picture.shape[:2]
    if columns < narrowest:
        times = -(-narrowest // columns)
        return np.repeat(np.repeat(picture, times, axis=0), times, axis=1)
    if columns > widest:
        return cv2.resize(picture, (widest, max(1, round(rows * widest / columns))),
                          interpolation=cv2.INTER_AREA)
    return picture


def _headed(picture, title, begin, end, colours):
    """Return a picture with a head: a title and a line, or a bar of colours with its two ends."""
    head = np.full((HEAD, picture.shape[1], 3), INVALID_GREY, np.uint8)
    _write(head, title, MARGIN, 20)
    first = _write(head, begin, MARGIN, 42)
    if colours is not None:
        width = cv2.getTextSize(end, cv2.FONT_HERSHEY_SIMPLEX, LETTERS, 1)[0][0]
        last = picture.shape[1] - width - 2 * MARGIN
        levels = np.linspace(0, 255, last - first).astype(np.uint8)
        head[42 - BAR:42, first:last] = cv2.applyColorMap(levels[np.newaxis], colours)
        _write(head, end, last + MARGIN, 42)
    return np.vstack([head, picture])


def _write(head, text, column, row):
    """Write text from a column on, standing on a row; return the column behind it."""
    cv2.putText(head, text, (column, row), cv2.FONT_HERSHEY_SIMPLEX, LETTERS, WHITE, 1,
                cv2.LINE_AA)
    width = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, LETTERS, 1)[0][0]
    return column + width + MARGIN
