# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The node with an rclpy before 7.1.4, which has no EventsExecutor."""
import sys

if __name__ == '__main__':
    sys.modules['rclpy.experimental'] = None    # importing it raises ImportError
    from fuzzy_stereo_ros.node import disparity_node, run_node
    if run_node.EventsExecutor is not None:
        sys.exit('there is an EventsExecutor')
    sys.exit(disparity_node.main())
