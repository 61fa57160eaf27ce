# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The propagated chromosome: each cell inherits a gene of the half-size chromosome around it.

Not in the paper. It takes the place of the scanline chromosome where that takes too long: what is
searched at full size is only what the half-size search has found nearby, see the kernel.
"""
from fuzzy_stereo_ros.matching.bands import cut_bands
from fuzzy_stereo_ros.matching.kernels.addresses import address_of
from fuzzy_stereo_ros.matching.kernels.scanlines import propagation as kernels
from fuzzy_stereo_ros.matching.realtime.scanlines import new_result, PAGE
from fuzzy_stereo_ros.matching.realtime.views import half_disparities
import numpy as np


class Propagation:
    """
    The propagation of one image size: memory and the chosen labels; used as Scanlines is.

    memory: uint8 (0,), nothing that others may use
    """

    stage, by_membership = 'propagation', False

    def __init__(self, possibility, tile):
        """Allocate for the size of a possibility; tile: rows that bands have a multiple of."""
        self._possibility, self.chosen = possibility, new_result(possibility)
        self._bands = cut_bands(possibility.rows, tile)
        self._last_parent = 2 * (half_disparities(possibility.disparities) - 1)
        sizes = kernels.sizes(possibility.disparities, self.chosen.target.shape[1])
        self.memory = np.empty(0, np.uint8)
        self._memory, self._tiles = zip(*(_tile(sizes) for _ in self._bands))

    def limit(self, pool, half_labels):
        """Do nothing: only the labels of the parent are searched."""

    def search(self, pool, half_prior, previous_prior=None):
        """
        Return the `SearchResult`, memory that the next search overwrites.

        pool: a ThreadPool, or a Chain, which completes the result; half_prior: the `Prior` of the
        half-size chromosome, the parent; previous_prior: not used
        """
        grey, features = self._possibility.left.grey, self._possibility.features
        self._parent = half_prior       # kept alive: the kernels have only its addresses
        self._pair = tuple(kernels.Pair(
            self._possibility.rows, *features, address_of(grey), grey.shape[1],
            address_of(half_prior.labels), address_of(half_prior.weights),
            half_prior.labels.itemsize, self._last_parent, self.chosen.target.shape[1],
            *map(address_of, self.chosen)))
        pool.each(self._propagate, self._bands)
        return self.chosen

    def _propagate(self, band):
        """Propagate the genes of a band."""
        kernels.propagate(self._pair, tuple(self._tiles[band[0]]), *band[1:])


def _tile(sizes):
    """Return memory, and the `Tile` of addresses in it."""
    starts = np.cumsum([0, *(-(-size // kernels.WIDE) * kernels.WIDE + kernels.WIDE
                             for size in sizes)])
    memory = np.zeros(starts[-1] + PAGE, np.uint8)
    first = memory.ctypes.data + -memory.ctypes.data % PAGE
    return memory, kernels.Tile(*(first + int(start) for start in starts[:-1]))
