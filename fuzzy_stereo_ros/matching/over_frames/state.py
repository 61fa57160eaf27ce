# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The state that a frame leaves for the next one: plain arrays and numbers, so that it can be saved.

Not in the paper. All profiles hand on averaged pictures and the data by which a moving camera is
followed; each profile adds a part of its own, the best of its search.
"""
from typing import Any, NamedTuple

from fuzzy_stereo_ros.matching.config import MatcherConfig
from fuzzy_stereo_ros.matching.kernels.temporal.change_detection import TILE
import numpy as np

LONGEST_GAP_NS = 1_000_000_000   # a previous frame older than this is forgotten


class CameraState(NamedTuple):
    """
    The data by which a moving camera is followed; empty arrays where no camera is known.

    half_grey: uint8 (r, c), left image at half size; cells: float32 (r, c), sub-pixel labels of
    every other pixel of every other row; cell_validity: uint8 (r, c), of these, 0 = consistent
    """

    half_grey: np.ndarray
    cells: np.ndarray
    cell_validity: np.ndarray

    def layout(self, shape, labels, known):
        """Return {name: (dtype, shape)} of the arrays; shape: of images; known: if a camera is."""
        cells = tuple(side // 2 for side in shape) if known else (0, 0)
        return {'half_grey': (np.uint8, cells), 'cells': (np.float32, cells),
                'cell_validity': (np.uint8, cells)}

    def check(self, labels):
        """Raise ValueError for a number that kernels, which check no index, cannot use."""
        if not ((self.cells >= 0) & (self.cells < labels)).all():
            raise ValueError('the state has cells out of range')


COMMON = 'pictures', 'ages', 'drifts', 'colours'        # arrays of all profiles
NO_COLOURS = np.zeros((0, 0, 0), np.uint16)
NO_CAMERA = CameraState(*(np.zeros((0, 0), kind) for kind in (np.uint8, np.float32, np.uint8)))


class FrameState(NamedTuple):
    """
    The state that a frame leaves for the next one.

    pictures: uint16 (2, R, C), luminance of both views, averaged, the right one mirrored; ages:
    float32 (2, tile rows, tile columns), frames averaged; drifts: float32 (2, 2, tile rows,
    tile columns), of each view, see add_drifts; colours: uint16 (N, R, C), channels of the views,
    averaged, NO_COLOURS where they are grey or not compared; camera: a `CameraState`; own: what
    the profile adds, a tuple of arrays and numbers, with the methods of `CameraState`, and `after`
    as below; left_shift: of the luminance, see luminance_shift; stamp: ns or None; frame: its
    number; config: the MatcherConfig.
    """

    pictures: np.ndarray
    ages: np.ndarray
    drifts: np.ndarray
    colours: np.ndarray
    camera: CameraState
    own: Any
    left_shift: int
    stamp: int | None
    frame: int
    config: MatcherConfig

    @property
    def shape(self):
        """Rows and columns of the images."""
        return self.pictures.shape[1:]

    def fits(self, shape, config, stamp):
        """Return whether a pair of a shape, taken at a stamp, may start from this frame."""
        if self.shape != shape or any(
                getattr(self.config, name) != getattr(config, name)
                for name in ('algorithm', 'disparities', 'min_disparity', 'reference')):
            return False
        if stamp is None or self.stamp is None:
            return stamp is self.stamp
        return 0 < stamp - self.stamp <= LONGEST_GAP_NS

    def before(self, stamp):
        """Return the state for a pair that is taken at a stamp."""
        return self._replace(own=self.own.after(0 if stamp is None else stamp - self.stamp))

    def arrays(self):
        """Return {name: array} of all its arrays."""
        return {**{name: getattr(self, name) for name in COMMON},
                **self.camera._asdict(), **_parted(self.own)[0]}

    def numbers(self):
        """Return {name: number} of the profile's part."""
        return _parted(self.own)[1]

    def check(self, labels):
        """
        Raise ValueError for arrays that kernels cannot use, as they check no index.

        labels: number of labels that are searched
        """
        shape = (*np.shape(self.pictures), 0, 0, 0)[1:3]     # pictures that are no three axes
        tiles, known = tuple(-(-side // TILE) for side in shape), np.size(self.camera.half_grey)
        layout = {'pictures': (np.uint16, (2, *shape)), 'ages': (np.float32, (2, *tiles)),
                  'drifts': (np.float32, (2, 2, *tiles)),
                  'colours': (np.uint16, (len(self.colours), *shape) if np.size(self.colours)
                              else (0, 0, 0)),
                  **self.camera.layout(shape, labels, known),
                  **self.own.layout(shape, labels, known)}
        for name, array in self.arrays().items():
            check_array(f'{name} of the state', array, *layout[name])
        if not (self.ages >= 1).all():
            raise ValueError('the state has ages out of range')
        if not np.isfinite(self.drifts).all() or (self.drifts[:, 1] < 0).any():
            raise ValueError('the state has drifts out of range')
        self.camera.check(labels)
        self.own.check(labels)


def restored(kind, arrays, numbers, **others):
    """
    Return the FrameState made of the `arrays` and `numbers` of another one.

    kind: the type of the profile's part; others: the remaining fields. Raises TypeError if an
    array or number is missing or not known.
    """
    found = dict(arrays)
    camera = {name: found.pop(name) for name in CameraState._fields if name in found}
    common = {name: found.pop(name) for name in COMMON if name in found}
    return FrameState(**common, camera=CameraState(**camera), own=kind(**found, **numbers),
                      **others)


def check_array(name, array, kind, shape):
    """Raise ValueError unless an array is of a dtype and shape."""
    if not isinstance(array, np.ndarray) or (array.dtype, array.shape) != (kind, shape):
        raise ValueError(f'{name} is {array.dtype} {array.shape}; needed is '
                         f'{np.dtype(kind)} {shape}')


def _parted(own):
    """Return {name: value} of the arrays and of the numbers of a tuple."""
    fields = own._asdict()
    arrays = {name: value for name, value in fields.items() if isinstance(value, np.ndarray)}
    return arrays, {name: value for name, value in fields.items() if name not in arrays}
