# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Subscribe to the four input topics while an output is wanted, and say why no pair arrives."""
from functools import partial
import os
import time
from typing import NamedTuple

from fuzzy_stereo_ros.node.parameters import OVERRIDABLE, quality_of
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.qos import qos_policy_name_from_kind
from sensor_msgs.msg import CameraInfo, CompressedImage, Image

TOPICS = ('left/image_rect', 'left/camera_info', 'right/image_rect', 'right/camera_info')
INFOS = TOPICS[1::2]
# Fast DDS reads a file of profiles from either; without one it loses large messages.
FAST_DDS_VARIABLES = ('FASTRTPS_DEFAULT_PROFILES_FILE', 'FASTDDS_DEFAULT_PROFILES_FILE')


class Subscriptions:
    """
    The subscriptions; all calls in the executor's thread.

    lost: {topic: messages that the middleware lost between two others}, where the topic has one
    publisher and the middleware numbers messages. Fast DDS has no `message_lost` event for a
    queue that overflows.
    """

    def __init__(self, node, settings, synchroniser, receive):
        """
        Subscribe to nothing yet.

        settings: of the node, by name. synchroniser: is told to drop what waits when the
        subscriptions end, and asked why no pair comes. receive(topic, message): called with each
        message.
        """
        self._node, self._settings = node, settings
        self._synchroniser, self._receive = synchroniser, receive
        self.lost = dict.fromkeys(TOPICS, 0)
        self._numbers = {}
        self._by_topic, self._latched, self._incompatible = {}, [], {}
        self.note_pair()

    def __bool__(self):
        """Return whether there are subscriptions."""
        return bool(self._by_topic)

    def serve(self, wanted):
        """Subscribe where an output is wanted, else end the subscriptions."""
        if wanted and not self._by_topic:
            self.note_pair()
            self._incompatible.clear()
            self._numbers.clear()
            self._by_topic = {topic: self._subscription(topic) for topic in TOPICS}
            if self._settings['cache_camera_info']:
                self._latched = [self._latched_subscription(topic) for topic in INFOS]
        elif self._by_topic and not wanted:
            for subscription in (*self._by_topic.values(), *self._latched):
                self._node.destroy_subscription(subscription)
            self._by_topic, self._latched = {}, []
            self._synchroniser.clear()

    def note_pair(self):
        """Start counting the time without a pair anew."""
        self._last_pair, self._reported = time.monotonic(), False
        self._received_before = dict(self._synchroniser.received)

    def seconds_without_pair(self, now):
        """Return for how many s no pair has come where that is too long, else 0."""
        seconds = now - self._last_pair
        return seconds if self and seconds > self._settings['no_pair_seconds'] else 0.0

    def report(self, now):
        """Return a sentence that says why no pair comes, once until the next one; else None."""
        seconds = self.seconds_without_pair(now)
        if self._reported or not seconds:
            return None
        self._reported = True
        topics = [
            TopicState(subscription.topic_name,
                       self._synchroniser.received[topic] - self._received_before[topic],
                       self._node.count_publishers(subscription.topic_name),
                       self._incompatible.get(topic, ''), self._synchroniser.holds(topic))
            for topic, subscription in self._by_topic.items()]
        return no_pair_report(seconds, topics, self._synchroniser.difference(),
                              self._settings['approximate_sync'])

    def _subscription(self, topic):
        kind, name = CameraInfo, topic
        if topic not in INFOS:
            kind = Image
            if self._settings['image_transport'] == 'compressed':
                kind, name = CompressedImage, f'{self._node.resolve_topic_name(topic)}/compressed'
        word = ('system_default' if self._settings['use_system_default_qos']
                else self._settings['input_qos'])
        return self._node.create_subscription(
            kind, name, partial(self._receive_numbered, topic), quality_of(word, depth=5),
            event_callbacks=SubscriptionEventCallbacks(
                incompatible_qos=partial(self._note_incompatible, topic),
                matched=partial(self._note_publisher, topic)),
            qos_overriding_options=OVERRIDABLE)

    def _latched_subscription(self, topic):
        """Return a subscription to camera_info published before; other publishers may not fit."""
        return self._node.create_subscription(
            CameraInfo, topic, partial(self._receive, topic), quality_of('latched'),
            event_callbacks=SubscriptionEventCallbacks(
                incompatible_qos=lambda event: None, use_default_callbacks=False))

    def _receive_numbered(self, topic, message, about):
        number = about['publication_sequence_number']
        before, self._numbers[topic] = self._numbers.get(topic), number
        if (None not in (before, number) and number > before + 1
                and self._node.count_publishers(self._by_topic[topic].topic_name) == 1):
            self.lost[topic] += number - before - 1
        self._receive(topic, message)

    def _note_publisher(self, topic, event):
        """Note that a publisher came, from which messages arrive, or went."""
        self._numbers.pop(topic, None)
        if event.current_count:
            self._incompatible.pop(topic, None)

    def _note_incompatible(self, topic, event):
        policy = qos_policy_name_from_kind(event.last_policy_kind).lower()
        subscription = self._by_topic[topic]
        requested = getattr(subscription.qos_profile, policy, None)
        if getattr(requested, 'name', '') == 'BEST_AVAILABLE':
            # It was fixed when it subscribed, by the publishers of then.
            self._node.destroy_subscription(subscription)
            self._by_topic[topic] = self._subscription(topic)
            return
        self._incompatible[topic] = policy
        self._node.get_logger().warning(
            f'a publisher of {subscription.topic_name} offers an incompatible QoS ({policy}); '
            'nothing arrives from it')


class TopicState(NamedTuple):
    """
    What is known of an input topic: messages received, publishers now, incompatible QoS.

    held: whether a message from before fits every pair.
    """

    name: str
    received: int
    publishers: int
    incompatible: str = ''
    held: bool = False


def large_messages_pass():
    """Return whether Fast DDS has a file of profiles."""
    return any(os.environ.get(name) for name in FAST_DDS_VARIABLES)


def no_pair_report(seconds, topics, difference, approximate):
    """
    Return one sentence that says why no pair may come and what to do.

    seconds: without a pair. topics: TopicState of each input, the counts since the last pair.
    difference: ns between the latest stamps of two topics at most, or None.
    approximate: whether stamps may differ.
    """
    counts = ', '.join(f'{topic.name} {topic.received}' for topic in topics)
    report = f'no stereo pair for {seconds:.0f} s; messages since then: {counts}'
    if difference is not None:
        report += f'; the latest stamps differ by up to {difference / 1e6:.3f} ms'
    missing = [topic for topic in topics if not (topic.received or topic.held)]
    remedies = [f'{topic.name} is offered with an incompatible QoS ({topic.incompatible}): set '
                f'qos_overrides.{topic.name}.subscription.{topic.incompatible}'
                for topic in missing if topic.incompatible and topic.publishers]
    unpublished = [topic.name for topic in missing if not topic.publishers]
    if unpublished:
        remedies.append(f"nobody publishes {', '.join(unpublished)}: start the camera driver, or "
                        'remap the topic')
    silent = [topic.name for topic in missing if topic.publishers and not topic.incompatible]
    if silent:
        hint = ('' if large_messages_pass() else
                ', and Fast DDS loses large best-effort images unless both sides run with '
                f"{FAST_DDS_VARIABLES[0]} set to this package's config/fastdds.xml")
        remedies.append(f"nothing arrives from the publishers of {', '.join(silent)}: they may "
                        f'be silent{hint}')
    if not missing:
        remedies.append(
            'stamps differ by more than approximate_sync_tolerance_seconds, or queue_size is too '
            'small' if approximate else
            'no stamp came on all four topics: set approximate_sync if the cameras do not stamp '
            'alike, or a larger queue_size')
    return '; '.join([report, *remedies])
