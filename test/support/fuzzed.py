# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""How many examples a fuzz test tries, bytes that were damaged, and places of values."""
from datetime import timedelta
from functools import partial

from hypothesis import HealthCheck, settings, strategies as st

USUAL = 100     # examples of the usual profile of hypothesis
# Longer is a hang: nothing that these tests call works for a second on a quiet machine.
LONGEST = timedelta(seconds=20)


def examples(number):
    """Return settings with a number of examples, multiplied by the profile of `make fuzz`."""
    return settings(max_examples=number * settings.default.max_examples // USUAL,
                    deadline=LONGEST, suppress_health_check=[
                        HealthCheck.too_slow, HealthCheck.function_scoped_fixture,
                        HealthCheck.data_too_large, HealthCheck.large_base_example])


def is_long():
    """Return whether this is `make fuzz`."""
    return settings.default.max_examples > USUAL


def damages():
    """Return a strategy of functions that damage bytes: change some, and often cut, anywhere."""
    return st.builds(
        lambda flips, kept: partial(_with_damage, flips=flips, kept=kept),
        st.lists(st.tuples(st.floats(0, 1, exclude_max=True), st.integers(1, 255)), max_size=8),
        st.one_of(st.just(1.0), st.just(1.0), st.floats(0, 1)))


def damaged(content):
    """Return a strategy of bytes with some of them changed, and often cut, at any place."""
    return damages().map(lambda damage: damage(content))


def _with_damage(content, flips, kept):
    damaged_bytes = bytearray(content)
    for place, bits in flips:
        damaged_bytes[int(place * len(content))] ^= bits
    return bytes(damaged_bytes[:round(kept * len(content))])


def leaves(tree, path=()):
    """Return the paths to all values of nested maps and lists."""
    items = (tree.items() if isinstance(tree, dict) else
             enumerate(tree) if isinstance(tree, list) else ())
    return [path] * bool(path) + [leaf for key, value in items
                                  for leaf in leaves(value, (*path, key))]
