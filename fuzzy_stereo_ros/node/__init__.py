# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The ROS node `disparity_node`, its process and its launch functions."""
from fuzzy_stereo_ros.program import say_that_ros_is_missing, use_one_arena

use_one_arena()     # before any module of this room imports rclpy, which starts threads
say_that_ros_is_missing()
