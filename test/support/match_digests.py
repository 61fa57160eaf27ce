# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
A program that prints digests of all bits that come of a sequence: profile, kind, frame, digest.

The first frame of each profile and kind is matched cold. OpenCV makes images that may differ in
the last bit on another processor: --images names a file that keeps them.
"""
from argparse import ArgumentParser
import hashlib
from pathlib import Path

from fuzzy_stereo_ros.matching import MatcherConfig, PROFILES, StereoMatcher
from fuzzy_stereo_ros.matching.realtime import matcher as realtime
from fuzzy_stereo_ros.synthetic.scenes import make_sequence
import numpy as np

FEW, MANY = 24, 120     # disparities
KINDS = {'grey': (np.uint8, False, FEW), 'colour of 16 bits': (np.uint16, True, FEW),
         'many disparities': (np.uint8, False, MANY)}


def make_images():
    """Return the images of three frames by kind: uint8 or uint16, (frames, 2, R, C[, 3])."""
    made = {}
    for name, (kind, colour, disparities) in KINDS.items():
        frames = make_sequence(97, 301, disparities, 3, noise=3.0, pan=2.0, colour=colour)
        made[name] = np.array([[frame.left, frame.right] for frame in frames], kind)
        made[name] *= kind(np.iinfo(kind).max // 255)
    return made


def digests(profile, pairs, disparities, threads):
    """Yield the digest of each match of a sequence of pairs."""
    changes = {'population': 6, 'generations': 3} if profile == 'paper' else {}
    matcher = StereoMatcher(MatcherConfig.from_profile(
        profile, disparities=disparities, threads=threads, warm_start=True, **changes))
    for left, right in pairs:
        match = matcher.match(left, right)
        digest = hashlib.sha256(match.disparity.tobytes() + match.confidence.tobytes())
        digest.update(repr([row.best_fitness for row in match.history]).encode())
        yield digest.hexdigest()


if __name__ == '__main__':
    parser = ArgumentParser(description=__doc__)
    parser.add_argument('profiles', nargs='*', default=PROFILES, help='all if none is given')
    parser.add_argument('--threads', type=int, default=1)
    parser.add_argument('--images', type=Path, help='read, or written where there is none')
    arguments = parser.parse_args()
    realtime.FEWEST_SHARED = 0      # threads share small images, too
    kept = arguments.images
    images = np.load(kept) if kept and kept.exists() else make_images()
    if kept and not kept.exists():
        np.savez(kept, **images)
    for profile in arguments.profiles:
        for kind, (_, _, disparities) in KINDS.items():
            if disparities == MANY and profile != 'realtime':
                continue        # it alone has windows of labels; the others would take long
            for number, digest in enumerate(
                    digests(profile, images[kind], disparities, arguments.threads)):
                print(profile, kind, number, digest, sep=', ', flush=True)
