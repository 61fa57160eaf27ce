# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Images as 16-bit luminance and 8-bit grey, which frames are compared and averaged in; their noise.

Not in the paper. Noise is estimated from second differences at full and at half size, in the
plainest tiles: the mean of 2 x 2 pixels halves white noise, while the second differences of
texture grow at the coarser size.
"""
from fuzzy_stereo_ros.matching.arrays import zeros
from fuzzy_stereo_ros.matching.kernels.possibility import features
from fuzzy_stereo_ros.matching.kernels.simd import LANES
from fuzzy_stereo_ros.matching.kernels.temporal.change_detection import (
    noise_level, roughness, TILE)
import numpy as np

BRIGHTER = 0.001    # share of an image that may saturate
SAMPLED = 8         # every SAMPLED-th row of an image of 8 bits is measured for its brightness
DARK_BITS = 6       # largest number of bits that a dark image of 8 bits uses
NOISY = 0.5         # grey levels of noise above which averaging gains more than warping loses


class Picture:
    """
    One image at one size: 16-bit luminance and 8-bit grey, allocated once.

    luminance: uint16, padded, see features; grey: uint8 (R, C + SLACK); both mirrored if asked for
    """

    def __init__(self, rows, columns, mirrored):
        """Allocate for an image of a size."""
        self.rows, self.columns, self.mirrored = rows, columns, mirrored
        self.luminance = zeros((rows + 2 * features.MARGIN,
                                columns + 2 * features.MARGIN + features.SLACK), np.uint16)
        self.grey = zeros((rows, columns + features.SLACK), np.uint8)

    def read(self, image, shift, left_shift, first, last):
        """
        Read the rows first to last - 1 of an image, moved to the right by `shift` columns.

        image: uint8 or uint16, (R, C) or (R, C, 3) BGR; left_shift: bits, of `luminance_shift`
        """
        fast = shift == 0 and image.dtype == np.uint8 and self.columns >= LANES
        if image.ndim == 3 and fast:
            features.luminance_of_bytes(image, left_shift, self.mirrored, self.luminance,
                                        self.grey, first, last)
            return
        features.luminance_of(image, shift, left_shift, self.mirrored, self.luminance, self.grey,
                              first, last)

    def spread(self, narrow, begin, first, last):
        """Copy the rows of a picture, from column `begin` on, and repeat its border around."""
        features.spread((narrow.luminance, narrow.grey), begin, (self.luminance, self.grey),
                        first, last)

    def halve(self, half, first, last):
        """Write the rows first to last - 1 of a `Picture` of half the size, mirrored alike."""
        offset = self.columns - 2 * half.columns if self.mirrored else 0
        features.halve(self.luminance, self.grey, half.columns, offset, half.luminance, half.grey,
                       first, last)


def luminance_shift(left, right, before=None):
    """
    Return by how many bits to shift a pair of images to the left for 16 bits of luminance.

    A dark picture is scaled to the full range. A share BRIGHTER of its pixels, lamps and faulty
    ones, may saturate: else few grey levels would be left for the rest. Pictures of 8 bits that
    are not dark keep their scale, so that it does not change from frame to frame. Others keep it
    until they need another one, or are darker by two bits where half as many pixels may saturate.

    before: what was returned for the previous pair, or None
    """
    deep = left.dtype != np.uint8
    images = (left, right) if deep else (left[::SAMPLED], right[::SAMPLED])

    def few_use(bits, share):
        # Most pictures have more than few in some rows already.
        return all(np.count_nonzero(rows >= 1 << (bits - 1)) <= share * image.size
                   for image in images for rows in (image[::SAMPLED], image))

    def shift_for(share, spare=0):
        bits = 8
        if deep or few_use(DARK_BITS + 1, share):   # else nothing more is counted
            bits = max(*(int(image.max()) for image in images), 1).bit_length()
            while bits > 1 and few_use(bits, share):
                bits -= 1
        bits = min(bits + spare, 16)
        return 16 - (2 if left.ndim == 3 else 0) - (bits if deep or bits <= DARK_BITS else 8)
    needed = shift_for(BRIGHTER)
    if before is None or before >= needed or before < shift_for(BRIGHTER / 2, 1):
        return needed
    return before


class NoiseEstimate:
    """
    An estimate of the noise of pictures of one size.

    rough: float32, by tile, see roughness; level: grey levels, deviation
    """

    def __init__(self, rows, columns):
        """Allocate for full images of a size."""
        self.rough, self._half_rough = (
            np.zeros((-(-height // TILE), -(-width // TILE)), np.float32)
            for height, width in ((rows, columns), (rows // 2, columns // 2)))
        self.level = 0.0

    def measure(self, picture, first, last):
        """Measure some rows of a `Picture`, from a multiple of 2 TILE on."""
        offset = picture.columns % 2 if picture.mirrored else 0
        roughness(picture.luminance, picture.columns, offset, self.rough, self._half_rough,
                  first, last)

    def estimate(self):
        """Write the `level`, once all rows are measured."""
        self.level = noise_level(self.rough, self._half_rough)
