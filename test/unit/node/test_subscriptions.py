# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Subscriptions: what the middleware lost, and why no pair comes."""
from types import SimpleNamespace

from fuzzy_stereo_ros.pairs.synchroniser import Synchroniser
from hypothesis import given, strategies
import pytest

subscriptions = pytest.importorskip('fuzzy_stereo_ros.node.subscriptions')
FAST_DDS_VARIABLES, TOPICS = subscriptions.FAST_DDS_VARIABLES, subscriptions.INPUT_TOPICS

NAMES = ('/left/image_rect', '/left/camera_info', '/right/image_rect', '/right/camera_info')
NO_STAMP = ('no stamp came on all four topics: set approximate_sync if the cameras do not stamp '
            'alike, or a larger queue_size')
NO_MESSAGE = 'no message arrives from the publishers of /right/image_rect: check that they publish'


def states(**changes):
    """Return four topics with messages and a publisher; changes by place, as in at2={...}."""
    return [subscriptions.TopicState(**{
        'name': name, 'received': 9, 'publishers': 1, **changes.get(f'at{place}', {})})
        for place, name in enumerate(NAMES)]


@pytest.mark.parametrize('topics, options, expected', [
    (states(at1={'received': 0, 'publishers': 0, 'name': '/cam/left/camera_info',
                 'image': '/cam/left/raw'}), {'cache': True},
     'no node publishes /cam/left/camera_info: start the camera driver, or remap the topic'),
    (states(at1={'received': 0, 'publishers': 0}, at3={'received': 4}), {},
     'no node publishes /left/camera_info: start the camera driver, or remap the topic; few or '
     'none of /left/camera_info, /right/camera_info: where they are sent once, or seldom, set '
     'cache_camera_info'),
    (states(), {'difference': 1_732_000_000 * 10**9},
     'some stamps are 0 or of another clock: let the drivers set header.stamp'),
    (states(at0={'received': 0, 'incompatible': 'reliability'}), {},
     '/left/image_rect is offered with an incompatible QoS (reliability): set '
     'qos_overrides./left/image_rect.subscription.reliability'),
    (states(at0={'incompatible': 'reliability'}), {}, NO_STAMP),
    (states(at0={'received': 0, 'publishers': 0, 'incompatible': 'reliability'}), {'profile': 0},
     'no node publishes /left/image_rect: start the camera driver, or remap the topic'),
    (states(at2={'received': 0}), {},
     f'{NO_MESSAGE}; Fast DDS loses large best-effort images unless the camera driver and this '
     "node run with FASTRTPS_DEFAULT_PROFILES_FILE set to this package's config/fastdds.xml"),
    (states(at2={'received': 0}), {'profile': 1}, NO_MESSAGE),
    (states(at1={'received': 0, 'publishers': 0, 'cached': True},
            at3={'received': 0, 'cached': True}), {'cache': True},
     NO_STAMP),
    (states(), {}, NO_STAMP),
    (states(), {'approximate': True},
     'stamps differ by more than approximate_sync_tolerance_seconds, or queue_size is too small'),
])
def test_the_report_ends_with_what_to_do(topics, options, expected, monkeypatch):
    for name in FAST_DDS_VARIABLES:
        monkeypatch.delenv(name, raising=False)
    if 'profile' in options:
        monkeypatch.setenv(FAST_DDS_VARIABLES[options['profile']], 'a file')
    report = subscriptions.no_pair_report(5.4, topics, options.get('difference', 1_500_000), {
        'cache_camera_info': options.get('cache', False),
        'approximate_sync': options.get('approximate', False)})
    counts = ', '.join(f'{topic.name} {topic.received}' for topic in topics).replace(
        '/cam/left/camera_info', '/cam/left/camera_info (derived from /cam/left/raw)')
    assert report.startswith(f'no stereo pair for 5 s; messages since then: {counts}; the latest '
                             'stamps differ by up to ')
    assert report.split(' ms; ', 1)[1] == expected


def received(numbers, publishers=1, publisher_changes_before=None):
    """Return {topic: lost} after messages with numbers on one topic."""
    node = SimpleNamespace(count_publishers=lambda name: publishers,
                           resolve_topic_name=lambda name, only_expand=False: f'/{name}',
                           create_subscription=lambda kind, name, *_, **__: SimpleNamespace(
                               topic_name=name))
    settings = {'cache_camera_info': False, 'image_transport': 'raw', 'input_qos': 'reliable',
                'use_system_default_qos': False, 'no_pair_seconds': 5.0}
    made = subscriptions.Subscriptions(
        node, settings, Synchroniser(TOPICS), lambda topic, message: None)
    made.update(True)
    for number in numbers:
        if number == publisher_changes_before:
            made._note_publisher(TOPICS[0], SimpleNamespace(current_count=1))
        made._receive_numbered(TOPICS[0], None, {'publication_sequence_number': number})
    return made.lost


@given(strategies.lists(strategies.booleans()), strategies.integers(1, 10**9))
def test_every_message_that_is_missing_between_two_others_is_counted(arrived, first):
    numbers = [number for number, there in enumerate([True, *arrived, True], first) if there]
    assert received(numbers) == {**dict.fromkeys(TOPICS, 0), TOPICS[0]: arrived.count(False)}


@pytest.mark.parametrize('numbers, options', [
    ([7, 1, 2], {}),                                    # a camera that was started again
    ([7, None, 90], {}),                                # a middleware that does not count
    ([7, 90, 8, 91], {'publishers': 2}),
    ([7, 90], {'publisher_changes_before': 90}),
    ([7, 7, 8], {})])
def test_what_need_not_be_a_loss_is_not_counted_as_one(numbers, options):
    assert received(numbers, **options)[TOPICS[0]] == 0


def test_a_pair_is_missed_where_messages_are_left_over_and_none_comes():
    synchroniser = Synchroniser(TOPICS, queue_size=1)
    made = subscriptions.Subscriptions(None, {}, synchroniser, None)
    steps = [((), False), (TOPICS, False), (TOPICS[:1], False), (TOPICS[:2], True), ((), False),
             (TOPICS, False)]
    for stamp, (topics, missed) in enumerate(steps):
        for topic in topics:
            synchroniser.add(topic, stamp, topic)
        assert made.misses_pairs() == missed
