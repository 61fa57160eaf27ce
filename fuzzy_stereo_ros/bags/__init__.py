# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Bags of ROS: reading, writing whole parts, copying, names of stereo topics."""
