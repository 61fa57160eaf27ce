# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Benchmarks: suites that measure the matcher and the node beside OpenCV, and their page."""
