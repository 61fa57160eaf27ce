# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Random numbers as a function of a counter: the same with any threads."""
from fuzzy_stereo_ros.matching.kernels.compiled import called, kernel
import numpy as np

_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_FIRST = np.uint64(0xBF58476D1CE4E5B9)
_SECOND = np.uint64(0x94D049BB133111EB)


@called
def mixed(key, counter):
    """Return 64 random bits that belong to a counter, uint64, under a key: one of SplitMix64."""
    bits = key + (counter + np.uint64(1)) * _GOLDEN
    bits = (bits ^ (bits >> np.uint64(30))) * _FIRST
    bits = (bits ^ (bits >> np.uint64(27))) * _SECOND
    return bits ^ (bits >> np.uint64(31))


_mixed = kernel(mixed)      # for Python


@called
def below(bits, limit):
    """Return a number below a limit, uint64 up to 2**32, by the upper half of 64 random bits."""
    return ((bits >> np.uint64(32)) * limit) >> np.uint64(32)


@called
def unit(bits):
    """Return a number from 0 up to but not including 1 made of 64 random bits, uint64."""
    return (bits >> np.uint64(11)) * 2.0**-53


@kernel
def fill_uniform(key, draws):
    """Write random numbers from 0 up to but not including 1: float64 (n,)."""
    for index in range(draws.size):
        draws[index] = unit(mixed(key, np.uint64(index)))


def key_of(*words):
    """
    Return the key of any number of words: whole numbers of any size and sign.

    How many there are is part of it, so that no number drawn under a key is itself the key of
    one word more.

    key: uint64; words beyond 64 bits count by their lowest 64
    """
    key = np.uint64(len(words))
    for word in words:
        key = np.uint64(_mixed(key, np.uint64(int(word) & 0xFFFFFFFFFFFFFFFF)))
    return key


@kernel
def scatter_random_genes(key, disparities, share, chromosome):
    """Draw a share of the genes of a chromosome, independent and uniform from all disparities."""
    rows, columns = chromosome.shape
    limit = np.uint64(disparities)
    drawn = np.uint64(np.ceil(share * 2.0**32))
    for row in range(rows):
        for column in range(columns):
            bits = mixed(key, np.uint64(row * columns + column))
            # the upper bits choose the gene, the lower ones whether it is drawn
            gene = np.uint16(below(bits, limit))
            chromosome[row, column] = gene if (
                bits & np.uint64(0xFFFFFFFF) < drawn) else chromosome[row, column]
