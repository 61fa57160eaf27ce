# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The result of matching one pair."""
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Match:
    """
    The result of matching one pair.

    disparity: float32 (R, C), pixels of the reference image, NaN = invalid.
    confidence: float32 (R, C), 0 to 1, from possibility; 0 where inconsistent or filled.
    history: a `Generation` for each that ran; times: milliseconds by stage, and `total`.
    warm: whether the previous best took part: as a prior, or as a parent.
    motion: how the camera moved, or why that is not known; '' where no camera was given.
    generations: how many ran; gains: by how much each operator raised the fitness.
    """

    disparity: np.ndarray
    confidence: np.ndarray
    history: list
    times: dict
    warm: bool
    motion: str = ''

    @property
    def generations(self):
        """How many generations ran."""
        return len(self.history)

    @property
    def gains(self):
        """By how much each operator raised the fitness of its population: {name: gain}."""
        gains = {}
        for generation in self.history:
            for name, gain in generation.gains.items():
                gains[name] = gains.get(name, 0.0) + gain
        return gains
