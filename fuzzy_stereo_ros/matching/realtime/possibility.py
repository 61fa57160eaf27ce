# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The possibility of a match, from census and gradient, at full and at half size.

Not in the paper: its three grey classes (Eq. 1, 2) do not tell pixels apart. The possibility of
two pixels is 1 - cost / largest cost, a membership that falls linearly with the Hamming distance
of their 5 x 5 census and with the difference of their gradients (Zabih and Woodfill, 1994).
"""
from typing import NamedTuple

from fuzzy_stereo_ros.matching.arrays import zeros
from fuzzy_stereo_ros.matching.kernels.addresses import address_of
from fuzzy_stereo_ros.matching.kernels.possibility import features, sharpness
from fuzzy_stereo_ros.matching.kernels.possibility.costs import CENSUS_CUT, Features, SLOPE_CUT
from fuzzy_stereo_ros.matching.kernels.scanlines.selection import Penalties
from fuzzy_stereo_ros.matching.over_frames.pictures import Picture
import numpy as np


class Model(NamedTuple):
    """The numbers of the possibility and of the smoothness, in cost units, for one image size."""

    near_weight: int        # how often the nearest eight neighbours of the census count: 1 or 2
    census_cut: int         # the largest Hamming distance that counts
    slope_cut: int          # the largest difference of gradients, in half grey levels
    box: int                # 0, or costs are sums of 3 x 3 pixels / 2**box
    small: int              # P1, a change of disparity by one
    jump: int               # P2, a jump, where grey is flat
    jump_at_edge: int       # P2 where grey steps by GREY_EDGE or more, and NOISY_EDGE times noise
    least_step: int         # of a darker pixel in the census, more than so many 1/256 grey level


FULL_SIZE = Model(near_weight=2, census_cut=CENSUS_CUT, slope_cut=SLOPE_CUT, box=0, small=16,
                  jump=83, jump_at_edge=17, least_step=0)
# Of pictures that JPEG quantised, and quantised coarsely: smaller steps are those of its blocks.
JPEG_SIZE = FULL_SIZE._replace(least_step=128)
COARSE_SIZE = FULL_SIZE._replace(least_step=320, jump=104)
HALF_SIZE = Model(near_weight=1, census_cut=10, slope_cut=4, box=2, small=22, jump=105,
                  jump_at_edge=28, least_step=0)
GREY_EDGE = 20      # grey levels of 8 bits
NOISY_EDGE = 2      # times the noise, standard deviation: its steps are no edges
SMALLEST = 64       # by which the sides of the smallest views are divided at most


class CensusPicture(Picture):
    """
    A picture with its census and gradient, allocated once.

    least_step: see `Model`; edges: the grey whose steps make a jump cheaper
    """

    def __init__(self, rows, columns, mirrored, reach):
        """reach: elements behind the columns that may be read in a mirrored image."""
        super().__init__(rows, columns, mirrored)
        stride = columns + reach + features.SLACK
        self._smoothed = zeros(self.luminance.shape, np.uint16), zeros(self.grey.shape, np.uint8)
        self.edges, self.least_step = self.grey, 0
        self.census = zeros((rows, 3, stride), np.uint8)
        self.slopes = zeros((rows, stride), np.uint8)

    def smooth(self, share, band):
        """Smooth a band of rows, see sharpness.smooth; they stay until `take_smoothed`."""
        sharpness.smooth(self.luminance, self.columns, share, *self._smoothed, *band[1:])

    def take_smoothed(self):
        """Exchange luminance and grey for the smoothed ones, but for `edges`."""
        self.edges = self.grey
        before, (self.luminance, self.grey) = (self.luminance, self.grey), self._smoothed
        self._smoothed = before

    def describe(self, first, last, tolerance=0):
        """Fill census and gradient of some rows; tolerance: see features.describe."""
        features.describe(
            (self.luminance, self.grey), tolerance, self.least_step, self.mirrored, self.columns,
            self.census, self.slopes, first, last)


class CensusPossibility:
    """The possibility of all matches of a pair at one size, as features to compute costs from."""

    def __init__(self, rows, columns, disparities, model, target_range=None, extra=0):
        """
        Allocate for images of a size and a number of disparities.

        target_range: the first and the last column of the target that exist, None: the image's;
        extra: columns of the target before column 0, see `extra_columns`
        """
        self.target_range = target_range or (0, columns - 1)
        self.model, self.rows, self.columns, self.disparities = model, rows, columns, disparities
        reach = -(-disparities // 32) * 32
        self.left = CensusPicture(rows, columns, False, 0)
        self.right = CensusPicture(rows, columns + extra, True, reach)
        self.features = Features(
            columns, model.near_weight, model.census_cut, model.slope_cut,
            *(address_of(plane) for view in (self.left, self.right)
              for plane in (view.census, view.slopes)),
            self.left.census.shape[2], self.left.slopes.shape[1], self.right.census.shape[2])
        self.penalties = Penalties(model.small, zeros((rows, columns), np.uint8),
                                   zeros((rows, columns), np.uint8))

    def use(self, model):
        """Use a model from now on, which differs from the one before in jumps and steps alone."""
        self.model = model
        self.left.least_step = self.right.least_step = model.least_step

    def describe(self, first, last, noise=0.0, tolerance=0):
        """Fill the features of some rows; noise: grey levels; tolerance: see features.describe."""
        self.left.describe(first, last, tolerance)
        self.right.describe(first, last, tolerance)
        model, edge = self.model, int(GREY_EDGE + NOISY_EDGE * noise)
        features.jump_penalties(
            self.left.edges, model.jump, model.jump_at_edge,
            -(-256 * (model.jump - model.jump_at_edge) // edge), self.penalties.across,
            self.penalties.down, first, last)


def extra_columns(min_disparity, disparities):
    """
    Return how many columns the target has before column 0 of the image, a multiple of SMALLEST.

    A negative smallest disparity moves the right image to the left, to columns below 0; labels
    reach only some of them. A multiple, so that smaller views are those of the same columns.
    """
    needed = columns_below(min_disparity, disparities + 2 * features.MARGIN)
    return needed + -needed % SMALLEST


def columns_below(lowest, farthest):
    """Return how many columns below 0 an image moved by the lowest disparity has, if reached."""
    return max(min(-lowest, farthest), 0)
