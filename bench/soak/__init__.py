# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The node for a long run, with faults from a seed, in the surroundings that its tests have."""
