# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The nearest features of two images among those that a rectified pair allows.

Not in the paper, whose pairs are rectified exactly. Few pairs of features are near enough to be
matched; only their bits are compared.
"""
from fuzzy_stereo_ros.matching.kernels.compiled import kernel
from fuzzy_stereo_ros.matching.kernels.simd import count_bits_of_word
import numpy as np

NONE = -1


@kernel(allocates=True)
def nearest_features(places, bits, other_places, other_bits, lowest, highest, apart, nearest,
                     distances):
    """
    Write which feature of another image is most like each feature; of equals the first one.

    places: float32 (2, N), column and row, px; bits: uint32 (N, words); the same of the M others;
    lowest, highest: of the difference of columns, apart: of that of rows at most, float32, px;
    nearest: int32 (N,), NONE where there is none so near; distances: int32 (N,), bits that differ
    """
    columns, rows = other_places[0], other_places[1]
    allowed = np.empty(len(columns), np.uint8)
    for one in range(places.shape[1]):
        column, row = places[0, one], places[1, one]
        nearest[one], least = NONE, 32 * bits.shape[1] + 1
        for other in range(len(columns)):
            difference = column - columns[other]
            allowed[other] = ((difference >= lowest) & (difference <= highest)
                              & (abs(row - rows[other]) <= apart))
        for other in range(len(columns)):
            if allowed[other]:
                differing = 0
                for word in range(bits.shape[1]):
                    differing += count_bits_of_word(
                        np.uint32(bits[one, word] ^ other_bits[other, word]))
                if differing < least:
                    nearest[one], least = other, differing
        distances[one] = least
