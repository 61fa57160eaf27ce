# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Pictures, videos and Rerun recordings of matches and of evolutions."""
