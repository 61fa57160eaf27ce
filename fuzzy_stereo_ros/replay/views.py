# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a replay shows: a video, and the Rerun viewer or a file for it."""
from contextlib import suppress
from itertools import islice, pairwise
from pathlib import Path
from statistics import median

from fuzzy_stereo_ros.bags.reading import DamagedBag
from fuzzy_stereo_ros.views.rerun_view import RerunSink
from fuzzy_stereo_ros.views.video import CODECS, RATES, VideoSink

VIEWER = 'the Rerun viewer'
STAMPS = 30             # pairs whose stamps tell the rate
RATE_WITHOUT = 10.0     # frames per second, of a video of one pair


def add_view_options(parser):
    """Add --video, --video-rate and --view."""
    views = parser.add_argument_group('what can be looked at')
    views.add_argument('--video', metavar='FILE',
                       help=f"{' or '.join(CODECS)}: image, disparity and confidence beside each "
                            'other, a frame for each pair')
    views.add_argument('--video-rate', metavar='NUMBER', type=float,
                       help='frames per second; default: as the stamps of the first pairs, so '
                            'that it lasts as long as what was recorded')
    views.add_argument('--view', metavar='FILE.rrd', nargs='?', const=VIEWER,
                       help='show image, disparity, confidence and points in the Rerun viewer, '
                            'or write a file for it; needs rerun-sdk')


def names_of_views(arguments):
    """Return what parsed options ask for, in words; an empty list is nothing."""
    return [name for name in (arguments.video, arguments.view) if name is not None]


def check_views(arguments):
    """Raise ValueError where a file is there that is to stay, or is to be continued."""
    if arguments.video_rate is not None and arguments.video is None:
        raise ValueError('--video-rate needs --video')
    for name in ('video', 'view'):
        path = getattr(arguments, name)
        if path in (None, VIEWER):
            continue
        if arguments.resume:
            raise ValueError(f'--resume cannot go on with {path}; leave out --{name}, or begin '
                             'anew with --overwrite')
        if Path(path).exists() and not arguments.overwrite:
            raise ValueError(f'--{name} is {path}, which is there already; give another file, '
                             'or --overwrite')


def views_of(arguments, config, source):
    """
    Return the sinks that parsed options ask for; files are begun with the first pair.

    config: the MatcherConfig of the images as they are matched. source: a ReplaySource that
    makes no pairs, whose stamps tell the rate.
    Raises ValueError for a file that cannot be written so, and where rerun-sdk or a display is
    missing.
    """
    views = []
    if arguments.video is not None:
        rate = rate_of(source) if arguments.video_rate is None else arguments.video_rate
        lowest = config.min_disparity
        views.append(VideoSink(arguments.video, rate, lowest, lowest + config.disparities - 1))
    if arguments.view is not None:
        views.append(RerunSink(None if arguments.view == VIEWER else arguments.view))
    return views


def rate_of(source):
    """Return how many pairs of a ReplaySource come in a second, as a video can have it."""
    stamps = []
    with suppress(DamagedBag):      # which is told where the replay comes to it
        for step in islice(source.steps(), STAMPS):
            if step.stamp is not None:
                stamps.append(step.stamp)
    steps = [after - before for before, after in pairwise(stamps) if after > before]
    if not steps:
        return RATE_WITHOUT
    lowest, highest = RATES
    return min(max(1e9 / median(steps), lowest), highest)
