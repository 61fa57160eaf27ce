# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Pairs: messages, calibration and image files in, disparity messages and files out."""
