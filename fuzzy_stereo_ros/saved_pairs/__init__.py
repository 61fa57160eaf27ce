# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Saved pairs: a pair with all that its match depends on, and its reproduction."""
