# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The real node lives on whatever its topics bring over DDS, counts it, and still matches."""
from drawn_messages import BENT_INFOS, COLUMNS, FILES, FORMATS, IMAGES, INFOS, ROWS
from fuzzed import damages, examples
from hypothesis import given, Phase, settings, strategies as st
from made_messages import compressed
from node_process import shifted_pair
import pytest
from soak_figures import broken_sums, faults_of, losses_of, losses_told
from soak_script import TOPICS

SMALL = shifted_pair(3, ROWS, COLUMNS)      # as small as what is drawn
DEPTH = 1000        # messages; more than are sent before an answer is awaited
QUEUE_SIZE = 5
OFTEN = 500         # pairs, after which the counts are looked at in between
MOMENTS = st.one_of(st.none(), st.none(), st.just('each'), st.tuples(
    st.integers(-2**31, 2**31 - 1), st.integers(0, 2**32 - 1)))
CAMERA_INFOS = st.one_of(INFOS, BENT_INFOS, BENT_INFOS, damages())
RAW = st.one_of(IMAGES, IMAGES, IMAGES, damages())
FORMED = st.builds(compressed, FILES, FORMATS)
COMPRESSED = st.one_of(FORMED, FORMED, FORMED, damages())


def spoilt_pairs(images):
    """Return a strategy of what `SpoiltPairs.send` takes as (moment, spoilt)."""
    drawn = {topic: CAMERA_INFOS if 'info' in topic else images for topic in TOPICS}
    one = st.one_of([st.fixed_dictionaries({topic: what}) for topic, what in drawn.items()])
    some = st.fixed_dictionaries({}, optional=drawn)
    return st.tuples(MOMENTS, st.one_of(one, one, some))


@pytest.mark.parametrize('images, suffix, parameters', [
    (RAW, '', {}),
    (COMPRESSED, '/compressed', {
        'image_transport': 'compressed', 'rectify': 'true', 'crop': 'true'})],
    ids=['raw', 'compressed and rectified'])
def test_whatever_the_topics_bring_is_counted_and_the_next_sound_pair_is_matched(
        make_bench, images, suffix, parameters):
    from spoilt_pairs import SpoiltPairs

    depths = {f"qos_overrides./{topic}{suffix if 'image' in topic else ''}.subscription.depth":
              DEPTH for topic in TOPICS}
    values = {'disparity_range': 8, 'queue_size': QUEUE_SIZE, **parameters, **depths}
    with make_bench('--ros-args', *(word for name, value in values.items()
                                    for word in ('-p', f'{name}:={value}')),
                    depth=DEPTH, compressed=bool(suffix)) as bench:
        cameras = SpoiltPairs(bench)

        def counts_that_add_up():
            counts = cameras.settle()
            assert broken_sums({**counts, 'queue_size': QUEUE_SIZE}, cameras.sent) == []
            return counts

        # A node that has died fails whatever follows: the first example is the one to be told.
        @settings(examples(50), phases=[Phase.explicit, Phase.generate])
        @given(spoilt_pairs(images))
        def any_pair(drawn):
            mark = bench.node.mark()
            cameras.send(SMALL, *drawn)
            cameras.match()
            assert not faults_of(bench.node.log(mark))
            if cameras.pairs > OFTEN:
                counts_that_add_up()

        any_pair()
        counts = counts_that_add_up()
        assert counts['pairs refused'] > 0     # how many is a matter of chance
        assert bench.node.finish() == 0
        assert not faults_of(bench.node.log())
        assert losses_told(bench.node.log()) == losses_of(counts)
