# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The demo: the node on a simulated camera, a table of figures and a picture."""
import fuzzy_stereo_ros.node    # noqa: F401  says what is missing where ROS is
