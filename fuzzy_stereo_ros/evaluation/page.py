# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The page of an evaluation: one self-contained HTML file with tables and pictures."""
import base64
import math
from pathlib import Path
from typing import NamedTuple

import cv2
from fuzzy_stereo_ros.evaluation.measuring import FILLED, RAW
from fuzzy_stereo_ros.evaluation.scores import ERROR_LIMIT, error_map
from fuzzy_stereo_ros.matching.match import colour_disparity, HATCH, STRIPE
from fuzzy_stereo_ros.pairs.image_files import in_eight_bits
import numpy as np

TEMPLATE = Path(__file__).with_name('page.html')
MOST_SCENES = 60        # with pictures, on a page
WIDTH = 400             # px, of the widest picture
POINT_RADIUS = 2.5      # px, of the points of a sparse truth
UNKNOWN_GREY = 110      # no truth
NO_DISPARITY = (190, 140, 0)    # BGR: a truth, but no disparity
COLOURS = {'turbo': cv2.COLORMAP_TURBO, 'magma': cv2.COLORMAP_MAGMA,
           'viridis': cv2.COLORMAP_VIRIDIS}     # of bars in the legend
STOPS = 17              # colours of a bar, between which a browser interpolates
LOSSLESS = 101          # quality of WebP
SHOWN = 99.5            # percentile of disparities at the end of the colours, without a truth


class View(NamedTuple):
    """What a page shows of a matcher: a title, lines of words, and pictures [(what, data URI)]."""

    title: str
    words: list
    pictures: list


class ShownPair(NamedTuple):
    """A pair on a page."""

    name: str
    facts: str  # in words
    views: list  # `View`s
    bars: list  # the legend: [(quantity, name of COLOURS, text of the lower end, of the upper)]


class Gallery:
    """The `ShownPair`s of scenes by name, the best and worst by the errors of ranked_by."""

    def __init__(self, ranked_by):
        self.ranked_by, self.shown, self._errors, self._limits = ranked_by, {}, {}, {}

    def show(self, pair, result, maps):
        """Draw a pair and {matcher's name: `Maps`}; drop a scene beyond the limit."""
        subject, error = result.subject, result.main_error(self.ranked_by)
        self._errors[subject.path] = math.inf if error is None or math.isnan(error) else error
        self._limits[subject.family] = subject.limit
        self.shown[subject.path] = _shown(pair, result, maps)
        if len(self.shown) > MOST_SCENES:
            ranked = self.ranked()
            dropped = -1 if self._errors[ranked[-1]] == math.inf else len(ranked) // 2
            del self.shown[ranked[dropped]]

    def ranked(self):
        """Return the names of the scenes, from the least error to the largest, then others."""
        return sorted(self.shown, key=self._errors.get)

    def order(self):
        """Return a sentence on the order of `ranked`, '' without errors."""
        if not any(map(math.isfinite, self._errors.values())):
            return ''
        limits = ', '.join(f'bad-{limit:g} of {family}' for family, limit in self._limits.items())
        order = f'From the least dense error of {self.ranked_by} to the largest: {limits}.'
        left_out = len(self._errors) - len(self.shown)
        return order + f' {left_out} in between have no pictures.' * bool(left_out)


def page_of(report, pairs, order=''):
    """Return the HTML page of a `Report` and `ShownPair`s, with a sentence on their order."""
    from jinja2 import Environment

    html = Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True)
    return html.from_string(TEMPLATE.read_text(encoding='utf-8')).render(
        report=report, pairs=pairs, order=order,
        colours={name: ', '.join(f'rgb{tuple(colour[::-1])}' for colour in cv2.applyColorMap(
            np.linspace(0, 255, STOPS).astype(np.uint8)[None], code)[0].tolist())
            for name, code in COLOURS.items()},
        hatch=HATCH, stripe=STRIPE, no_disparity=NO_DISPARITY[::-1], unknown=UNKNOWN_GREY) + '\n'


def _shown(pair, result, maps):
    facts = ', '.join(filter(None, (
        result.subject.layout, f'{result.size[1]}x{result.size[0]}',
        f'{result.disparities} disparities')))
    if result.records and result.records[0]['mask']:
        facts += f", figures: {result.records[0]['mask']}"
    limit, truth = f'{result.subject.limit:g}', getattr(pair, 'truth', None)
    first = View('left image', [], [('left image', data_uri(in_eight_bits(pair.left),
                                                            cv2.INTER_AREA))])
    bars = [('error', 'magma', '0', f'{ERROR_LIMIT:g} px and more')]
    if truth is None:
        seen = np.concatenate([one.raw[np.isfinite(one.raw)] for one in maps.values()])
        ends = np.percentile(seen, (100 - SHOWN, SHOWN)) if seen.size else (0, 1)
        bars = [('confidence', 'viridis', '0', '1')]
    else:
        valid = np.isfinite(truth)
        ends = (float(truth[valid].min()), float(truth[valid].max())) if valid.any() else (0, 1)
        first = View('left image and truth', [], [*first.pictures, ('truth', data_uri(
            colour_disparity(_thickened(truth, valid), *ends)))])
    views = [first]
    for name, found in maps.items():
        raw, filled = result.record(name, RAW), result.record(name, FILLED)
        words = [f"density {raw['covered']:.1f} %" + (
            '' if found.milliseconds is None else f', {found.milliseconds:.1f} ms')]
        pictures = [(f'disparity by {name}', data_uri(colour_disparity(found.raw, *ends)))]
        if truth is not None:
            words = [f"bad-{limit}: {filled['bad_dense_' + limit]:.2f} % dense, "
                     f"{raw['bad_sparse_' + limit]:.2f} % sparse", *words]
            pictures.append((f'error of {name}', data_uri(colour_error(found.raw, truth))))
        elif found.confidence is not None:
            pictures.append((f'confidence by {name}', data_uri(cv2.applyColorMap(
                cv2.convertScaleAbs(found.confidence, alpha=255), cv2.COLORMAP_VIRIDIS))))
        views.append(View(name, words, pictures))
    return ShownPair(result.subject.path, facts, views, [
        ('disparity', 'turbo', f'{ends[0]:.1f}', f'{ends[1]:.1f} px'), *bars])


def data_uri(image, interpolation=cv2.INTER_NEAREST):
    """Return an image, uint8 (R, C) or (R, C, 3) BGR, as the data URI of a reduced WebP file."""
    rows, columns = image.shape[:2]
    if columns > WIDTH:
        image = cv2.resize(image, (WIDTH, max(1, round(rows * WIDTH / columns))),
                           interpolation=interpolation)
    _, content = cv2.imencode('.webp', image, [cv2.IMWRITE_WEBP_QUALITY, LOSSLESS])
    return f'data:image/webp;base64,{base64.b64encode(content).decode()}'


def colour_error(disparity, truth):
    """
    Return the error of a map in the colours of Magma: uint8 (R, C, 3) BGR.

    disparity, truth: float (R, C), pixels, NaN or infinite = invalid. Black is no error, the
    brightest colour one of ERROR_LIMIT px or more; grey has no truth, blue a truth but no
    disparity.
    """
    error = np.minimum(error_map(disparity, truth), ERROR_LIMIT)    # of NaN: NaN
    levels = _thickened(np.nan_to_num(error, nan=2 * ERROR_LIMIT), np.isfinite(truth))
    shares = np.clip(np.nan_to_num(levels) / ERROR_LIMIT, 0, 1)
    picture = cv2.applyColorMap(np.rint(255 * shares).astype(np.uint8), cv2.COLORMAP_MAGMA)
    picture[levels > ERROR_LIMIT] = NO_DISPARITY
    picture[np.isnan(levels)] = UNKNOWN_GREY
    return picture


def _thickened(values, there):
    """Return a map, float32 (R, C), whose points are discs if they are less than half of it."""
    if np.count_nonzero(there) > there.size / 2 or not there.any():
        return np.where(there, values, np.float32(np.nan))
    distance, nearest = cv2.distanceTransformWithLabels(
        np.uint8(~there), cv2.DIST_L2, cv2.DIST_MASK_5, labelType=cv2.DIST_LABEL_PIXEL)
    of_points = np.zeros(nearest.max() + 1, np.float32)
    of_points[nearest[there]] = values[there]
    return np.where(distance <= POINT_RADIUS, of_points[nearest], np.float32(np.nan))
