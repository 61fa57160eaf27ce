# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Units of the numbers that kernels of several stages write and read."""

STEPS = 16      # sub-pixel steps in a pixel
# Validity of a match: the other view agrees; it points beyond the other image, where nothing can
# be compared; the other view disagrees, or it is a speckle.
CONSISTENT, OUTSIDE, INVALID = 0, 1, 2
