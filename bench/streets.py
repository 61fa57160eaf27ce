# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Drives through synthetic streets whose planes carry the pictures of scikit-image."""
import cv2
from fuzzy_stereo_ros.synthetic.scenes import BASELINE, drive_through, FOCAL, SceneOptions
from fuzzy_stereo_ros.synthetic.street import GRAIN, LAYER_MARGIN, OCTAVES, rig_of, street
import numpy as np

# in turn, from the one of the seed on: road, wall at the end, side walls, objects
PICTURES = 'gravel', 'rocket', 'brick', 'coffee', 'chelsea', 'astronaut', 'coins', 'grass'


def make_pictured_street(rows, columns, disparities, frames, seed, **options):
    """
    Return an iterator over each `ScenePair` of a drive, in colour; options: of `SceneOptions`.

    Geometry, motion and noise are those of `make_sequence`.
    """
    import skimage.data     # takes a second

    options = SceneOptions(rows, columns, disparities, frames, seed, colour=True, **options)
    rig = rig_of(rows, columns, disparities, FOCAL * columns, BASELINE)
    pictures = [_coloured(getattr(skimage.data, name)()) for name in PICTURES]
    planes = []
    for number, plane in enumerate(street(rig, options)):
        layers, mean = picture_layers(pictures[(seed + number) % len(pictures)])
        planes.append(plane._replace(layers=layers, mean=mean))
    return drive_through(rig, planes, options)


def picture_layers(picture):
    """
    Return the layers and the mean of a `Plane` that carries a picture, uint8 (R, C, 3).

    A layer is a band of its Laplacian pyramid (Burt and Adelson 1983), repeated: so bands finer
    than a pixel are left out as those of noise are.
    """
    level = cv2.resize(picture, (GRAIN, GRAIN), interpolation=cv2.INTER_AREA).astype(np.float32)
    layers = []
    for octave in range(OCTAVES - 1):
        coarser = cv2.pyrDown(level)
        band = level - cv2.pyrUp(coarser, dstsize=level.shape[:2])
        layers.append(np.tile(band, (2**octave, 2**octave, 1)))
        level = coarser
    layers.append(np.zeros_like(layers[0]))
    return np.pad(layers, ((0, 0), LAYER_MARGIN, LAYER_MARGIN, (0, 0)), 'wrap'), level.reshape(3)


def _coloured(picture):
    """Return a picture of scikit-image, RGB or grey, in BGR."""
    return cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR if picture.ndim == 2 else cv2.COLOR_RGB2BGR)
