# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Comparing matchers: pairs with ground truth, rivals, figures and tables of them."""
