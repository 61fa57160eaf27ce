# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A program that prints digests of all bits that come of a sequence: profile, kind, digest."""
import hashlib
import sys

from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.synthetic.scenes import make_sequence
import numpy as np

KINDS = {'grey': (np.uint8, False), 'colour of 16 bits': (np.uint16, True)}


def digests(profile, threads):
    """Yield (kind, digest) of a sequence of three frames."""
    for name, (kind, colour) in KINDS.items():
        changes = {'population': 6, 'generations': 3} if profile == 'paper' else {}
        matcher = StereoMatcher(MatcherConfig.from_profile(
            profile, disparities=24, threads=threads, warm_start=True, **changes))
        digest = hashlib.sha256()
        for frame in make_sequence(131, 97, 24, 3, noise=3.0, pan=2.0, colour=colour):
            left, right = (image.astype(kind) * kind(np.iinfo(kind).max // 255)
                           for image in (frame.left, frame.right))
            match = matcher.match(left, right)
            digest.update(match.disparity.tobytes() + match.confidence.tobytes())
            digest.update(repr([row.best_fitness for row in match.history]).encode())
        yield name, digest.hexdigest()


if __name__ == '__main__':
    for profile in ('realtime', 'quality', 'paper'):
        for kind, digest in digests(profile, int(sys.argv[1])):
            print(profile, kind, digest, sep=', ')
