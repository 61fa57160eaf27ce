# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Made pairs that are matched as the truth has it: what sinks of matched pairs are tested with."""
from fuzzy_stereo_ros.matching import MatcherConfig
from fuzzy_stereo_ros.matching.match import Match
from fuzzy_stereo_ros.matching.row_alignment import Rows
from fuzzy_stereo_ros.pair_matcher import MatchedPair
from fuzzy_stereo_ros.pairs.stereo_pair import Calibration, Projection, StereoPair
from fuzzy_stereo_ros.synthetic.scenes import make_pair
import numpy as np

DISPARITIES = 24
CALIBRATION = Calibration(focal=400.0, baseline=0.1, offset=-1.5,
                          left=Projection(400.0, 402.0, 170.0, 60.0))


def made_matched(rows=60, columns=330, stamp=1_250_000_000, reference='left', **options):
    """
    Return a MatchedPair with the true disparities, invalid where hidden, and a ramp as confidence.

    options: those of `make_pair`.
    """
    made = make_pair(rows, columns, DISPARITIES, **options)
    disparity = np.where(made.visible, made.truth, np.nan).astype(np.float32)
    confidence = np.tile(np.linspace(0, 1, columns, dtype=np.float32), (rows, 1))
    return MatchedPair(StereoPair(made.left, made.right, CALIBRATION, stamp),
                       Match(disparity, confidence, [], {}, False),
                       MatcherConfig(disparities=DISPARITIES, reference=reference), None, Rows())
