# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Synthetic pairs of upright layers of like contrast everywhere, which pan or slowly come nearer.

Such texture may be taken for noise: it is as sharp as a pixel, or as faint as the noise.
"""
import cv2
from fuzzy_stereo_ros.synthetic.scenes import ScenePair
import numpy as np

BACKGROUND, BACKGROUND_CONTRAST = 8.0, 30.0     # px of disparity; grey levels
# of each object: column and row of its centre, half its width and height, disparity, px
OBJECTS = ((80, 70, 35, 40, 20.0), (180, 120, 30, 70, 28.0), (250, 60, 35, 30, 17.0),
           (140, 190, 45, 30, 25.0), (290, 180, 28, 40, 23.0), (370, 100, 30, 50, 30.0))
MARGIN = 5      # texels around a texture, which repeats


def make_layers(rows, columns, frames, seed, contrast, blur, *, pan=0.0, approach=0.0):
    """
    Return an iterator over `ScenePair`s of objects before a background, grey uint8.

    contrast: of the objects, standard deviation in grey levels; blur: of the lens, px, standard
    deviation; pan: px a frame to the left; approach: px by which the disparity of the objects
    grows a frame, in the right image. The first frame lies at a random fraction of a pixel if
    objects come nearer, at none if not.
    """
    random = np.random.default_rng([seed, 5])
    start = random.uniform(0, 1) if approach else 0.0
    layers = [(None, BACKGROUND, _texture(random, rows, columns, BACKGROUND_CONTRAST, blur))]
    layers += [(box, disparity + start, _texture(random, rows, columns, contrast, blur))
               for *box, disparity in OBJECTS]
    y, x = np.mgrid[0:rows, 0:columns].astype(np.float32)

    def view(frame, from_right, x):
        image, nearest = np.zeros((rows, columns), np.float32), np.full((rows, columns), -1.0)
        for box, disparity, texture in layers:
            disparity += approach * frame if box else 0
            here = x + pan * frame + from_right * disparity
            seen = disparity > nearest
            if box:
                seen &= (abs(here - box[0]) <= box[2]) & (abs(y - box[1]) <= box[3])
            width = texture.shape[1] - 2 * MARGIN
            grey = cv2.remap(texture, (here % width + MARGIN).astype(np.float32), y + MARGIN,
                             cv2.INTER_CUBIC)
            image[seen], nearest[seen] = grey[seen], disparity
        return image, nearest

    def pair(frame):
        (left, truth), (right, _) = view(frame, False, x), view(frame, True, x)
        _, nearest = view(frame, True, x - truth)
        exposed = (np.clip(np.rint(image), 0, 255).astype(np.uint8) for image in (left, right))
        return ScenePair(*exposed, truth.astype(np.float32),
                         (x >= truth) & (nearest <= truth + 1e-6))

    return map(pair, range(frames))


def _texture(random, rows, columns, contrast, blur):
    """Return blurred white noise, float32 (rows + margins, columns + margins), that repeats."""
    fine = random.standard_normal((rows, columns), np.float32)
    fine = np.pad(fine, MARGIN + 20, 'wrap')
    if blur:
        fine = cv2.GaussianBlur(fine, (0, 0), blur)
    fine = fine[20:-20, 20:-20]
    return np.float32(random.uniform(100, 140)) + np.float32(contrast / fine.std()) * fine
