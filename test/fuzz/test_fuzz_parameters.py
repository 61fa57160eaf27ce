# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The real node lives on whatever is set over its services, all or nothing, and still matches."""
import math

from fuzzed import examples
from fuzzy_stereo_ros.parameters.table import ROS_PARAMETERS
from hypothesis import given, strategies as st
from made_scenes import shifted_pair

PAIR = shifted_pair(7)
ARGUMENTS = '-p', 'disparity_range:=16'
NAMES = [row.name for row in ROS_PARAMETERS]
ROW_OF = dict(zip(NAMES, ROS_PARAMETERS))
LARGEST = 2**63 - 1
# What is allowed among it asks for little work and leaves room for the pair.
OF_TYPE = {
    bool: st.booleans(),
    int: st.one_of(st.integers(-3, 24),
                   st.sampled_from([-LARGEST - 1, LARGEST, 2**31, 10**7])),
    float: st.one_of(st.floats(-1, 24),
                     st.sampled_from([math.nan, math.inf, -math.inf, 1e300, 5e-324])),
    str: st.one_of(
        st.text(st.characters(exclude_categories=['Cs'], exclude_characters='\0'), max_size=20),
        st.sampled_from(['paper', 'quality', 'left', 'rank', 'sigmoid']))}
VALUES = st.one_of(
    *OF_TYPE.values(), st.lists(st.integers(0, 9), min_size=1, max_size=3),
    st.lists(st.sampled_from([b'\0', b'\xff']), min_size=1, max_size=2))

# In its range and not allowed, text that is no choice, and what only the start may set.
REJECTED = {'neighbourhood': (4, 'neighbourhood is 4; allowed are odd numbers from 1 to 31'),
            'algorithm': ('luck', "algorithm is 'luck'; allowed are realtime, quality, paper"),
            'queue_size': (3, 'read-only parameter: queue_size')}
# Mostly what ROS lets through: parameters that may change, values of their type.
CHANGES = st.one_of(st.sampled_from([row for row in ROS_PARAMETERS if not row.read_only]),
                    st.sampled_from(ROS_PARAMETERS)).flatmap(lambda row: st.tuples(
                        st.just(row.name), st.one_of(OF_TYPE[type(row.default)], VALUES)))


def same(one, other):
    return repr(one) == repr(other)     # NaN is like itself


def test_any_values_are_set_all_at_once_or_rejected_with_a_reason(bench):
    first = dict(zip(NAMES, bench.parameters(*NAMES)))
    changeable = {name: first[name] for name in NAMES if not bench.descriptor(name).read_only}

    @examples(50)
    @given(st.lists(CHANGES, min_size=1, max_size=3).map(dict))
    def any_change(changes):
        before = bench.parameters(*NAMES)
        done, reason = bench.set_parameters(**changes)
        after = dict(zip(NAMES, bench.parameters(*NAMES)))
        if not done:
            assert reason
            assert same([*after.values()], before)
        else:
            assert all(after[name] == ROW_OF[name].checked(value)
                       for name, value in changes.items())

    any_change()
    for name, (value, why) in REJECTED.items():
        done, reason = bench.set_parameters(speckle_size=7, **{name: value})
        assert not done and why in reason
    assert bench.parameters('speckle_size') != [7]
    assert bench.set_parameters(**changeable) == (True, '')
    bench.until(lambda: not bench.counts()['change of parameters'].startswith('being'),
                'all is prepared', timeout=120)
    assert bench.match(*PAIR).max_disparity == 15.0
    bench.change(disparity_range=8)
    bench.change(min_disparity=-2)      # to what is in force, not to what was before
    assert bench.match(*PAIR).max_disparity == 5.0
