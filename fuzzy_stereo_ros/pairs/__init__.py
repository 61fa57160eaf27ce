# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""How pairs come in and disparities go out: messages, files, folders; no ROS import."""
