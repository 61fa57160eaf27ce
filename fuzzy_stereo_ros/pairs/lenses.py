# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the names and coefficients of a lens mean: one rule for files and messages."""
import re

from fuzzy_stereo_ros.pairs.stereo_pair import BadPair
import numpy as np

EQUIDISTANT = 'equidistant'
COEFFICIENTS = {'plumb_bob': (4, 5, 8, 12, 14), 'rational_polynomial': (4, 5, 8, 12, 14),
                EQUIDISTANT: (4,)}      # numbers that D may have, by distortion_model
# What else programs call these, in lower case without signs; '' leaves it open.
NAMES = {'radtan': 'plumb_bob', 'radialtangential': 'plumb_bob', 'brownconrady': 'plumb_bob',
         'equi': EQUIDISTANT, 'fisheye': EQUIDISTANT, 'kannalabrandt': EQUIDISTANT,
         'kannalabrandt4': EQUIDISTANT, 'pinhole': '', 'perspective': '', 'none': ''}
LARGEST_NUMBER = 1e9        # absolute value in K, D and P, as products must stay finite


def model_of(names, shape=None):
    """
    Return the distortion_model of ROS for what a program calls a camera and its lens.

    names: texts, None or ''. shape: of D, where its file tells it; BadPair where 4 x 1 may be of
    two models. Names unknown or of two models are returned: `coefficients_of` rejects them.
    """
    found = {NAMES.get(re.sub('[^a-z0-9]', '', str(name).lower()), str(name))
             for name in names if name} - {''}
    if not found and shape == (4, 1):
        raise BadPair('calibration', 'D is 4 x 1, as cv2.fisheye makes it, but is not said to be '
                      'of a fisheye: add the line "distortion_model: fisheye" to the file, or '
                      '"distortion_model: plumb_bob"')
    return ' and '.join(sorted(found - COEFFICIENTS.keys() or found)) or 'plumb_bob'


def coefficients_of(model, d):
    """
    Return D for OpenCV: float64 (N,), without zeros beyond the fourth.

    No coefficients are four zeros, which of a fisheye are no pinhole's: angle and radius are
    proportional. Raises BadPair for another model, or D of another size or of no usable numbers.
    """
    if model not in COEFFICIENTS:
        raise BadPair('calibration', f'distortion_model is {model!r:.60}; allowed are '
                      f"{', '.join(COEFFICIENTS)}; for others, which are not supported, rectify "
                      'elsewhere, and set rectify and crop to false')
    d, allowed = np.ravel(np.array(d, float)), COEFFICIENTS[model]
    if not d[4:].any():
        d = d[:4] if d.size else np.zeros(4)
    if d.size not in allowed or not are_usable(d):
        raise BadPair('calibration', f'D has {d.size} numbers; allowed for {model} are '
                      f"{', '.join(map(str, allowed))} finite ones, none above "
                      f'{LARGEST_NUMBER:g}')
    return d


def lens_of(names, d):
    """Return `model_of` names and `coefficients_of` D, an array of any shape or None."""
    d = () if d is None else d
    model = model_of(names, np.shape(d))
    return model, coefficients_of(model, d)


def are_usable(values):
    """Return whether all numbers are finite and at most `LARGEST_NUMBER`."""
    return bool(np.all(np.abs(values) <= LARGEST_NUMBER))
