# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The profile `realtime`: one page that is the frame, then a file for each stage."""
