# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Evaluation: pairs with ground truth, matchers beside baselines, scores, tables, a page."""
