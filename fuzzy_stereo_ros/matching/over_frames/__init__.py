# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What frames hand on in every profile: averaged pictures, the camera's motion, the state."""
