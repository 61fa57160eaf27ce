# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Compiled plane genes: their costs and exchange, fits of planes, segments, evidence."""
