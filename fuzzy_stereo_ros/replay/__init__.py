# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Replay of bags: source, matcher, sinks, and segments matched in parallel."""
