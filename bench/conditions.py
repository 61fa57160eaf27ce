# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Conditions: errors on pairs as a rig on a robot gives them, beside OpenCV's matchers.

Not in the paper, whose pairs are of a laboratory. Rows no longer fit, exposures differ, lenses
darken the corners, pictures are compressed, there is little light. Each condition is made of the
clean pair; all matchers get the same pictures.
"""
from dataclasses import replace
from functools import partial

from bench.draws import in_words, means_over_draws, random_of
from bench.request import counted, report_of, Subject
from bench.scoring import bad_percent
import cv2
from fuzzy_stereo_ros.evaluation.baselines import dense, TUNED
from fuzzy_stereo_ros.evaluation.report import Table
from fuzzy_stereo_ros.matching.row_offsets import grey
import numpy as np

OURS, GREY = 'ours', 'ours, grey'
BASELINES = [one for one in TUNED if one.algorithm in ('3WAY', 'HH4')]
OPENCV = [one.name for one in BASELINES]
SHOT, READ, COLUMNS = 0.06, 1.0, 0.7    # variances a grey level and at 0; deviation of columns
DARKER, DARK_NOISE = 6, 0.8             # divisor; grey levels, standard deviation


def misaligned(image, tilt=0.0, roll=0.0, zoom=0.0):
    """
    Return an image, uint8 or uint16 (R, C, ...), as a misaligned camera would take it.

    tilt: px by which the content moves down. roll: degrees of its clockwise rotation about the
    centre. zoom: percent by which it is larger.
    """
    rows, columns = image.shape[:2]
    middle = np.array([(columns - 1) / 2, (rows - 1) / 2])
    angle = np.deg2rad(roll)
    turn = (1 + zoom / 100) * np.array([[np.cos(angle), -np.sin(angle)],
                                        [np.sin(angle), np.cos(angle)]])
    moved = np.column_stack([turn, middle + (0, tilt) - turn @ middle])
    return cv2.warpAffine(image, moved, (columns, rows), flags=cv2.INTER_CUBIC,
                          borderMode=cv2.BORDER_REFLECT_101)


def as_it_is(image, random):
    """Return an image as it is."""
    return image


def lower(image, random, rows):
    """Return an image whose content lies lower by a number of rows."""
    return misaligned(image, tilt=rows)


def exposed(image, random, gain, offset=0.0):
    """Return the grey levels of an image, times a gain and with an offset."""
    return gain * image + offset


def curved(image, random, gamma):
    """Return an image with another gamma."""
    return 255 * (image / 255.0) ** gamma


def vignetted(image, random, gain=1.0):
    """Return an image times a gain, which falls with the square of the radius to its half."""
    rows, columns = image.shape[:2]
    y, x = np.linspace(-1, 1, rows)[:, None], np.linspace(-1, 1, columns)
    fall = gain * (1 - 0.5 * (rows**2 * y**2 + columns**2 * x**2) / (rows**2 + columns**2))
    return image * (fall if image.ndim == 2 else fall[:, :, None])


def blurred(image, random, sigma):
    """Return an image blurred by a Gaussian; sigma: px."""
    return cv2.GaussianBlur(image, (0, 0), sigma)


def compressed(image, random, quality):
    """Return an image after JPEG of a quality from 0 to 100."""
    _, coded = cv2.imencode('.jpg', image, [cv2.IMWRITE_JPEG_QUALITY, quality])
    return cv2.imdecode(coded, cv2.IMREAD_UNCHANGED)


def noisy(image, random):
    """Return an image with shot noise and read noise, and columns that differ."""
    columns = COLUMNS * random.standard_normal(image.shape[1])
    noise = np.sqrt(READ + SHOT * image) * random.standard_normal(image.shape)
    return image + noise + (columns if image.ndim == 2 else columns[:, None])


def darkened(image, random):
    """Return an image of a sixth of the light, with noise."""
    return image / DARKER + DARK_NOISE * random.standard_normal(image.shape)


# {name: what becomes of the left and of the right image}
CONDITIONS = {
    'clean': (as_it_is, as_it_is),
    **{f'rows {rows:g} px lower': (as_it_is, partial(lower, rows=rows)) for rows in (0.5, 1, 1.5)},
    'gain 0.7, 8 levels less': (as_it_is, partial(exposed, gain=0.7, offset=-8)),
    'gamma 1.4': (as_it_is, partial(curved, gamma=1.4)),
    'corners of half the light in both, gain 0.9': (vignetted, partial(vignetted, gain=0.9)),
    'both times 0.75': (partial(exposed, gain=0.75),) * 2,
    'blur of 1.2 px': (as_it_is, partial(blurred, sigma=1.2)),
    **{f'both JPEG {quality}': (partial(compressed, quality=quality),) * 2
       for quality in (95, 80, 50)},
    'shot and read noise, unlike columns': (noisy, noisy),
    'a sixth of the light': (darkened, darkened),
}


def under_condition(pair, name, draw=0):
    """Return a `GroundTruthPair` of 8 bits under one of CONDITIONS, with the noise of a draw."""
    random = random_of(draw)
    left, right = (
        np.clip(np.rint(change(image, random)), 0, 255).astype(np.uint8)
        for change, image in zip(CONDITIONS[name], (pair.left, pair.right)))
    return replace(pair, left=left, right=right)


def run(request):
    """Return the `Report` of our matcher and OpenCV's under CONDITIONS, of a `Request`."""
    scenes, skipped = request.scenes()
    figures, = request.drawn(([
        Subject(scene, name, bool({noisy, darkened} & {*both})) for scene in scenes
        for name, both in CONDITIONS.items()], 'conditions', partial(measure, request.ours)))
    return report_of('conditions', 'Pictures as cameras give them', {
        'ours': f'{request.ours.description}, filled, cold; colour images, *grey*: the grey ones '
                'that OpenCV gets',
        'error': 'percent of pixels off, and OpenCV tuned and filled, as in accuracy',
        **in_words(request.draws),
        'pictures': 'the right one changes, where not *both* are named, or noise and light; '
                    f'columns differ by {COLUMNS:g} grey levels, variance of the noise '
                    f'{READ:g} + {SHOT:g} x grey level; with a sixth of the light noise of '
                    f'{DARK_NOISE:g}',
    }, [table(figures)], skipped, scenes=figures)


def measure(ours, subject, draw):
    """Return a list of a dict of errors: group, scene, condition and matchers."""
    scene, name, _ = subject
    known, disparities = scene.read(), scene.disparities
    pair = under_condition(known, name, draw)
    images = pair.left, pair.right
    maps = {who: ours.matcher(disparities).match(*those).disparity for who, those in (
        (OURS, images), (GREY, map(grey, images)))}
    maps.update((one.name, dense(one.matcher(scene.family, disparities).match(*images)))
                for one in BASELINES)
    return [{'group': scene.group, 'scene': scene.path, 'condition': name,
             **{who: bad_percent(found, known, scene.limit) for who, found in maps.items()}}]


def table(figures):
    """Return the table of a DataFrame of the dicts of `measure`."""
    mean = means_over_draws(counted(figures), ['group', 'condition'], [OURS, GREY, *OPENCV])
    beside = mean.apply(lambda row: '/'.join(
        f'{error:.2f}' for error in (row[OURS], row[GREY], min(row[OPENCV]))), axis=1)
    return Table.of('Conditions: mean error in percent, ours / ours, grey / OpenCV',
                    beside.unstack('group', sort=False),
                    f'OpenCV: the better of {" and ".join(OPENCV)} in the group.')
