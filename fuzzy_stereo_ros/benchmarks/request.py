# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a benchmark is asked for: which matcher, on which scenes, and who watches."""
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from fuzzy_stereo_ros.benchmarks.datasets import available_scenes
from fuzzy_stereo_ros.benchmarks.sequences import available_sequences
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher

QUICK_KINDS = 'window, noise 0, pan 0', 'window, noise 6, pan 2', 'hard cut'


@dataclass(frozen=True)
class Request:
    """
    What a benchmark is asked for.

    profile, changes: the matcher under test, changes being {parameter: value}.
    data: folder of the benchmark data, or None. only: a word that scenes must contain.
    repeats: how often a time is taken. follow(items, title): iterates and shows progress.
    quick: small and few, to see that all runs; the figures then say nothing.
    """

    profile: str = 'realtime'
    changes: dict = field(default_factory=dict)
    data: Path | None = None
    only: str = ''
    repeats: int = 15
    follow: Callable = field(default=lambda items, title: items)
    quick: bool = False

    def config(self, disparities, **forced):
        """Return the configuration under test: dense, from 0, on one thread unless forced."""
        given = {'fill': True, 'threads': 1, **self.changes, **forced}
        return MatcherConfig.from_profile(self.profile, disparities=disparities, **given)

    def matcher(self, disparities, **forced):
        """Return a matcher of the configuration under test."""
        return StereoMatcher(self.config(disparities, **forced))

    def scenes(self):
        """Return the scenes that are asked for and here, and sentences about those missing."""
        return available_scenes(self.data, self.only, self.quick)

    def sequences(self, scenes):
        """Return the sequences that can be made here, and sentences about those missing."""
        if not self.quick:
            return available_sequences(self.data, scenes)
        found, _ = available_sequences(None, scenes)
        return [sequence for sequence in found if sequence.kind in QUICK_KINDS], []

    @property
    def subject(self):
        """The matcher under test in words."""
        changes = ', '.join(f'{name} = {value}' for name, value in sorted(self.changes.items()))
        return f'profile {self.profile}' + (f' with {changes}' if changes else '')
