# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Pairs of a made sequence as a running matcher saw them, each ready to be saved."""
from functools import cache

from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.pair_matcher import camera_of
from fuzzy_stereo_ros.pairs.stereo_pair import Calibration, Projection, StereoPair
from fuzzy_stereo_ros.saved_pair import SavedPair
from fuzzy_stereo_ros.synthetic.scenes import make_sequence

DISPARITIES = 24
PERIOD = 100_000_000        # ns
CALIBRATION = Calibration(
    focal=500.25, baseline=0.12, offset=-1.5, left=Projection(501.0, 502.0, 50.5, 30.0),
    remarks=('fx is 501 in the left and 500.25 in the right camera_info',))
ABOUT = {'input rate': '29.9 pairs/s', 'profile': 'realtime, with µ'}


@cache
def running(profile='realtime', grey='', bits=8, min_disparity=0, frames=3, **changes):
    """
    Return a tuple of SavedPair, one for each frame of a noisy sequence that one matcher matched.

    grey: which image has no colour: '', 'left', 'right' or 'both'.
    """
    config = MatcherConfig.from_profile(
        profile, disparities=DISPARITIES, min_disparity=min_disparity, **changes)
    matcher, saved = StereoMatcher(config), []
    for number, frame in enumerate(make_sequence(
            60, 100, DISPARITIES, frames, min_disparity=min_disparity, noise=4.0, colour=True,
            bits=bits)):
        images = {side: getattr(frame, side) for side in ('left', 'right')}
        for side in images:
            if grey in (side, 'both'):
                images[side] = images[side][:, :, 1].copy()
        pair = StereoPair(**images, calibration=CALIBRATION, stamp=(number + 1) * PERIOD,
                          frame_id='left_camera')
        state, rows = matcher.state, matcher.rows
        match = matcher.match(pair.left, pair.right, stamp=pair.stamp, camera=camera_of(pair))
        saved.append(SavedPair(pair, config, state, match, ABOUT, rows=rows))
    return tuple(saved)
