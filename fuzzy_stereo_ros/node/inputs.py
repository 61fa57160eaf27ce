# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The four topics that come in: subscribed to while somebody wants what comes of them."""
from functools import partial
import time

from fuzzy_stereo_ros.node.gaps import Gaps
from fuzzy_stereo_ros.node.quality_of_service import (
    input_quality, is_best_available, LATCHED, OVERRIDABLE)
from fuzzy_stereo_ros.node.watchdog import no_pair_report, TopicState
from fuzzy_stereo_ros.pairs.messages import stamp_of
from fuzzy_stereo_ros.pairs.synchroniser import Synchroniser
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.qos import qos_policy_name_from_kind
from sensor_msgs.msg import CameraInfo, CompressedImage, Image

TOPICS = ('left/image_rect', 'left/camera_info', 'right/image_rect', 'right/camera_info')
INFOS = TOPICS[1::2]


class Inputs:
    """
    Subscriptions and their synchroniser; all calls in the executor's thread.

    synchroniser: the Synchroniser, whose counts are for everybody to read. lost: {topic: messages
    that the middleware lost}.
    """

    def __init__(self, node, settings, tolerance, take):
        """
        Subscribe to nothing yet.

        settings: of the node, by name. tolerance: as of a Synchroniser. take(found, arrived):
        called with each MatchedSet and the time.monotonic() of its last message.
        """
        self._node, self._settings, self._take = node, settings, take
        held = INFOS if settings['cache_camera_info'] else ()
        self.synchroniser = Synchroniser(TOPICS, settings['queue_size'], tolerance, held)
        self._gaps = Gaps(TOPICS)
        self.lost = self._gaps.lost
        self._topics, self._latched, self._incompatible = {}, [], {}
        self._quiet_since, self._received_before, self._told = 0.0, {}, False

    def __bool__(self):
        """Return whether there are subscriptions."""
        return bool(self._topics)

    def serve(self, wanted):
        """Subscribe where something is wanted, else take the subscriptions back."""
        if wanted and not self._topics:
            self._begin_quiet()
            self._incompatible.clear()
            for topic in TOPICS:
                self._gaps.begin(topic)
            self._topics = {topic: self._subscription(topic) for topic in TOPICS}
            if self._settings['cache_camera_info']:
                self._latched = [self._latched_info(topic) for topic in INFOS]
        elif self._topics and not wanted:
            for subscription in (*self._topics.values(), *self._latched):
                self._node.destroy_subscription(subscription)
            self._topics, self._latched = {}, []
            self.clear()

    def clear(self):
        """Let go of all messages that wait for others."""
        self.synchroniser.clear()

    def quiet(self, now):
        """Return for how many s no pair has come where that is too long, else 0."""
        seconds = now - self._quiet_since
        return seconds if self and seconds > self._settings['no_pair_seconds'] else 0.0

    def report(self, now):
        """Return a sentence that says why no pair comes, once a silence; else None."""
        seconds = self.quiet(now)
        if self._told or not seconds:
            return None
        self._told = True
        topics = [
            TopicState(subscription.topic_name,
                       self.synchroniser.received[topic] - self._received_before[topic],
                       self._node.count_publishers(subscription.topic_name),
                       self._incompatible.get(topic, ''), self.synchroniser.holds(topic))
            for topic, subscription in self._topics.items()]
        return no_pair_report(
            seconds, topics, self.synchroniser.difference(), self._settings['approximate_sync'])

    def _subscription(self, topic):
        kind, name = CameraInfo, topic
        if topic not in INFOS:
            kind = Image
            if self._settings['image_transport'] == 'compressed':
                kind, name = CompressedImage, f'{self._node.resolve_topic_name(topic)}/compressed'
        return self._node.create_subscription(
            kind, name, partial(self._receive_numbered, topic), input_quality(self._settings),
            event_callbacks=SubscriptionEventCallbacks(
                incompatible_qos=partial(self._note_incompatible, topic),
                matched=partial(self._note_publisher, topic)),
            qos_overriding_options=OVERRIDABLE)

    def _latched_info(self, topic):
        """Return a subscription to camera_info published before; others do not fit, and may."""
        return self._node.create_subscription(
            CameraInfo, topic, partial(self._receive, topic), LATCHED,
            event_callbacks=SubscriptionEventCallbacks(
                incompatible_qos=lambda event: None, use_default_callbacks=False))

    def _note_publisher(self, topic, event):
        """Take note that a publisher came, from which messages arrive, or went."""
        self._gaps.begin(topic)
        if event.current_count:
            self._incompatible.pop(topic, None)

    def _note_incompatible(self, topic, event):
        policy = qos_policy_name_from_kind(event.last_policy_kind).lower()
        subscription = self._topics[topic]
        if is_best_available(subscription.qos_profile, policy):
            # It was fixed when it subscribed, by the publishers of then.
            self._node.destroy_subscription(subscription)
            self._topics[topic] = self._subscription(topic)
            return
        self._incompatible[topic] = policy
        self._node.get_logger().warning(
            f'a publisher of {subscription.topic_name} offers an incompatible QoS ({policy}); '
            'nothing arrives from it')

    def _receive_numbered(self, topic, message, about):
        self._gaps.note(topic, about['publication_sequence_number'],
                        lambda: self._node.count_publishers(self._topics[topic].topic_name))
        self._receive(topic, message)

    def _receive(self, topic, message):
        for found in self.synchroniser.add(topic, stamp_of(message.header), message):
            self._begin_quiet()
            self._take(found, self._quiet_since)

    def _begin_quiet(self):
        self._quiet_since, self._told = time.monotonic(), False
        self._received_before = dict(self.synchroniser.received)
