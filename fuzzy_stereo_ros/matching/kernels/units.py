# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Units of the numbers that kernels of several stages write and read."""

STEPS = 16      # sub-pixel steps in a pixel
# Validity of a match: the other view agrees; the match lies outside the other image and cannot be
# compared; the other view disagrees, or the match belongs to a speckle.
CONSISTENT, OUTSIDE, INVALID = 0, 1, 2
VOTED = 6       # weight of a prior whose evidence is that of a whole region, see weight_of
SURE = 255      # certainty that limits no confidence
