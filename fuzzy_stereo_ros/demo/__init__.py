# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The demonstration: the node beside a simulated camera, its figures and a picture."""
