# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Draws of noise: what a draw is, and means over draws with the worst one beside them.

The number of a draw is the seed of its noise, which is the same for all matchers and variants.
"""
from dataclasses import replace

import numpy as np
import pandas as pd

DRAWS, QUICK_DRAWS = 8, 2


class Drawn(float):
    """The mean of a figure over draws; prints as `mean (worst)`, worst: that of one draw."""

    def __new__(cls, mean, worst=np.nan):
        made = super().__new__(cls, mean)
        made.worst = float(worst)
        return made

    def __format__(self, spec):
        return f'{float(self):{spec}} ({self.worst:{spec}})'


def in_words(draws):
    """Return the setting of a report: how many draws there are, and what is printed of them."""
    return {'draws': f'with noise: means of {draws} draws, in brackets the worst draw; the noise '
                     'of a draw is the same for all; what has no noise is measured once'}


def random_of(draw):
    """Return the source of the noise of a draw, by its number."""
    return np.random.default_rng(draw)


def with_noise(image, sigma, random, alike=True):
    """
    Return an image, uint8, with normal noise, rounded and clipped.

    sigma: grey levels, standard deviation. alike: equal in the channels of a pixel.
    """
    if not sigma:
        return np.ascontiguousarray(image)
    noise = sigma * random.standard_normal(image.shape[:2] if alike else image.shape)
    noise = noise if noise.ndim == image.ndim else noise[:, :, None]
    return np.clip(np.rint(image + noise), 0, 255).astype(np.uint8)


def with_draw(pairs, sigma, draw, alike=True):
    """Return a list of `GroundTruthPair`s with fresh noise in each image; see `with_noise`."""
    random = random_of(draw)
    return [replace(pair, left=with_noise(pair.left, sigma, random, alike),
                    right=with_noise(pair.right, sigma, random, alike)) for pair in pairs]


def by_draw(frame, names, figure):
    """
    Return a DataFrame of the means of a figure: a row for each value of names, a column a draw.

    frame: DataFrame with a row for each scene and draw, and a column `draw`. names: of columns.
    """
    return frame.groupby([*names, 'draw'], sort=False)[figure].mean().unstack('draw', sort=False)


def over_draws(each, worst='max'):
    """
    Return a Series of the means of the rows of `by_draw`, `Drawn` where there are several draws.

    worst: 'max' or 'min'
    """
    each = each.astype(float)
    figures = zip(each.count(axis=1), each.mean(axis=1), each.agg(worst, axis=1))
    return pd.Series([Drawn(mean, worst) if draws > 1 else mean for draws, mean, worst in figures],
                     each.index, dtype=object)


def means_over_draws(frame, names, figures=None, worst='max'):
    """Return a DataFrame with `over_draws` of each of the figures, None: of all numbers."""
    figures = figures or frame.select_dtypes('number').columns.drop('draw')
    return pd.DataFrame({figure: over_draws(by_draw(frame, names, figure), worst)
                         for figure in figures})
