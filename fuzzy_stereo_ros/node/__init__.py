# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The parts of `disparity_node` that speak with ROS; all else is done by the flat files."""
from fuzzy_stereo_ros.memory import share_free_memory

share_free_memory()     # here, as importing rclpy, which the parts do, starts threads
