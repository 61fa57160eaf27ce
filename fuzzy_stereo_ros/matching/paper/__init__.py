# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The profile `paper`: the genetic algorithm of Ghazouani, read in two ways."""
