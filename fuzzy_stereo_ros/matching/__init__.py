# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The algorithm: two arrays in, disparity and confidence out."""
from fuzzy_stereo_ros.matching.config import MatcherConfig, PROFILES
from fuzzy_stereo_ros.matching.match import Match
from fuzzy_stereo_ros.matching.matcher import StereoMatcher, WARM_UP_SIZE

__all__ = ['Match', 'MatcherConfig', 'PROFILES', 'StereoMatcher', 'WARM_UP_SIZE']
