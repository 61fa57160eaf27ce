# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Benchmarks: every figure that is claimed, printed by one command, side by side with OpenCV."""
