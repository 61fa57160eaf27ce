# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Synthetic stereo scenes with exact ground truth, and cameras that publish them."""
