# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Compiled kernels, one idea a file: they decide nothing and write into arrays given to them."""
