# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Subscribe to the four input topics while an output is wanted; explain why no pair arrives."""
from functools import partial
import os
import time
from typing import NamedTuple

from fuzzy_stereo_ros.node.parameters import OVERRIDABLE, qos_profile
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.qos import qos_policy_name_from_kind
from sensor_msgs.msg import CameraInfo, CompressedImage, Image

INPUT_TOPICS = ('left/image_rect', 'left/camera_info', 'right/image_rect', 'right/camera_info')
INFO_TOPICS = INPUT_TOPICS[1::2]
OTHER_CLOCK = 10**17    # ns, more than three years, by which stamps of one clock do not differ
# Either names a file of profiles for Fast DDS, which loses large messages without one.
FAST_DDS_VARIABLES = ('FASTRTPS_DEFAULT_PROFILES_FILE', 'FASTDDS_DEFAULT_PROFILES_FILE')


class Subscriptions:
    """
    The subscriptions of the node; all calls come from the executor's thread.

    lost: {topic: number of messages that the middleware lost}. They are counted by gaps in the
    sequence numbers of a topic with one publisher, as Fast DDS reports no `message_lost` event
    when a queue overflows.
    """

    def __init__(self, node, settings, synchroniser, receive):
        """Create none yet; receive(topic, message): called with each; settings: by name."""
        self._node, self._settings = node, settings
        self._synchroniser, self._receive = synchroniser, receive
        self.lost = dict.fromkeys(INPUT_TOPICS, 0)
        self._last_numbers = {}
        self._by_topic, self._latched, self._incompatible = {}, [], {}
        self._counted = 0, 0
        self.note_pair()

    def __bool__(self):
        """Return whether there are subscriptions."""
        return bool(self._by_topic)

    def update(self, wanted):
        """Subscribe if an output is wanted, else end the subscriptions."""
        if wanted and not self._by_topic:
            self.note_pair()
            self._incompatible.clear()
            self._last_numbers.clear()
            self._by_topic = {topic: self._subscription(topic) for topic in INPUT_TOPICS}
            if self._settings['cache_camera_info']:
                self._latched = [self._latched_subscription(topic) for topic in INFO_TOPICS]
        elif self._by_topic and not wanted:
            for subscription in (*self._by_topic.values(), *self._latched):
                self._node.destroy_subscription(subscription)
            self._by_topic, self._latched = {}, []
            self._synchroniser.clear()

    def note_pair(self):
        """Restart the time without a pair at 0."""
        self._last_pair, self._reported = time.monotonic(), False
        self._received_before = dict(self._synchroniser.received)

    def seconds_without_pair(self, now):
        """Return the s since the last pair if they exceed no_pair_seconds, else 0."""
        seconds = now - self._last_pair
        return seconds if self and seconds > self._settings['no_pair_seconds'] else 0.0

    def misses_pairs(self):
        """Return whether messages were left over and no pair came since the call before."""
        (matched, left_over), self._counted = self._counted, (
            self._synchroniser.matched, sum(self._synchroniser.unmatched.values()))
        return self._counted[0] == matched and self._counted[1] > left_over

    def report(self, now):
        """Return, once until the next pair, a sentence that says why no pair comes; else None."""
        seconds = self.seconds_without_pair(now)
        if self._reported or not seconds:
            return None
        self._reported = True
        topics = [
            TopicState(subscription.topic_name,
                       self._synchroniser.received[topic] - self._received_before[topic],
                       self._node.count_publishers(subscription.topic_name),
                       self._incompatible.get(topic, ''), self._synchroniser.has_cached(topic),
                       self._source(topic)[1])
            for topic, subscription in self._by_topic.items()]
        return no_pair_report(seconds, topics, self._synchroniser.difference(), self._settings)

    def _source(self, topic):
        """Return the name of an input, and of the image that it is derived from, '' for none."""
        resolve = self._node.resolve_topic_name
        # As in stereo_image_proc; here a camera_info that is remapped itself goes there.
        if topic in INFO_TOPICS and resolve(topic) == resolve(topic, only_expand=True):
            image = resolve(topic.replace('camera_info', 'image_rect'))
            beside = f"{image.rpartition('/')[0]}/camera_info"
            if beside != resolve(topic):
                return beside, image
        return topic, ''

    def _subscription(self, topic):
        kind, name = CameraInfo if topic in INFO_TOPICS else Image, self._source(topic)[0]
        if kind is Image and self._settings['image_transport'] == 'compressed':
            kind, name = CompressedImage, f'{self._node.resolve_topic_name(topic)}/compressed'
        qos = ('system_default' if self._settings['use_system_default_qos']
               else self._settings['input_qos'])
        return self._node.create_subscription(
            kind, name, partial(self._receive_numbered, topic), qos_profile(qos, depth=5),
            event_callbacks=SubscriptionEventCallbacks(
                incompatible_qos=partial(self._note_incompatible, topic),
                matched=partial(self._note_publisher, topic)),
            qos_overriding_options=OVERRIDABLE)

    def _latched_subscription(self, topic):
        """Return a subscription that also receives a camera_info published before."""
        return self._node.create_subscription(
            CameraInfo, self._source(topic)[0], partial(self._receive, topic),
            qos_profile('latched'),
            event_callbacks=SubscriptionEventCallbacks(     # a publisher need not latch
                incompatible_qos=lambda event: None, use_default_callbacks=False))

    def _receive_numbered(self, topic, message, message_info):
        number = message_info['publication_sequence_number']
        last, self._last_numbers[topic] = self._last_numbers.get(topic), number
        if (None not in (last, number) and number > last + 1
                and self._node.count_publishers(self._by_topic[topic].topic_name) == 1):
            self.lost[topic] += number - last - 1
        self._receive(topic, message)

    def _note_publisher(self, topic, event):
        self._last_numbers.pop(topic, None)
        if event.current_count:
            self._incompatible.pop(topic, None)

    def _note_incompatible(self, topic, event):
        policy = qos_policy_name_from_kind(event.last_policy_kind).lower()
        subscription = self._by_topic[topic]
        requested = getattr(subscription.qos_profile, policy, None)
        if getattr(requested, 'name', '') == 'BEST_AVAILABLE':
            # ROS chose the QoS by the publishers of that time: subscribe again.
            self._node.destroy_subscription(subscription)
            self._by_topic[topic] = self._subscription(topic)
            return
        self._incompatible[topic] = policy
        self._node.get_logger().warning(
            f'a publisher of {subscription.topic_name} offers an incompatible QoS ({policy}): its '
            'messages do not arrive')


class TopicState(NamedTuple):
    """The state of an input topic."""

    name: str
    received: int           # messages since the last pair
    publishers: int
    incompatible: str = ''  # QoS policy that keeps a publisher's messages away
    cached: bool = False    # whether an earlier message serves every pair
    image: str = ''         # the topic from which this name is derived


def has_fast_dds_profile():
    """Return whether an environment variable names a file of profiles for Fast DDS."""
    return any(os.environ.get(name) for name in FAST_DDS_VARIABLES)


def no_pair_report(seconds, topics, difference, settings):
    """Return why no pair came for seconds, and what to do; difference: of stamps, ns, or None."""
    counts = ', '.join(
        topic.name + f' (derived from {topic.image})' * bool(topic.image) + f' {topic.received}'
        for topic in topics)
    report = f'no stereo pair for {seconds:.0f} s; messages since then: {counts}'
    if difference is not None:
        report += f'; the latest stamps differ by up to {difference / 1e6:.3f} ms'
    missing = [topic for topic in topics if not (topic.received or topic.cached)]
    remedies = [f'{topic.name} is offered with an incompatible QoS ({topic.incompatible}): set '
                f'qos_overrides.{topic.name}.subscription.{topic.incompatible}'
                for topic in missing if topic.incompatible and topic.publishers]
    unpublished = [topic.name for topic in missing if not topic.publishers]
    if unpublished:
        remedies.append(f"no node publishes {', '.join(unpublished)}: start the camera driver, or "
                        'remap the topic')
    silent = [topic.name for topic in missing if topic.publishers and not topic.incompatible]
    if silent:
        hint = ('' if has_fast_dds_profile() else
                '; Fast DDS loses large best-effort images unless the camera driver and this node '
                f"run with {FAST_DDS_VARIABLES[0]} set to this package's config/fastdds.xml")
        remedies.append(f"no message arrives from the publishers of {', '.join(silent)}: check "
                        f'that they publish{hint}')
    seldom = [info.name for image, info in zip(topics[::2], topics[1::2])
              if 2 * info.received < image.received]
    if seldom and not settings['cache_camera_info']:
        remedies.append(f"few or none of {', '.join(seldom)}: where they are sent once, or "
                        'seldom, set cache_camera_info')
    if difference is not None and difference > OTHER_CLOCK:
        remedies.append('some stamps are 0 or of another clock: let the drivers set header.stamp')
    elif not missing:
        remedies.append(
            'stamps differ by more than approximate_sync_tolerance_seconds, or queue_size is too '
            'small' if settings['approximate_sync'] else
            'no stamp came on all four topics: set approximate_sync if the cameras do not stamp '
            'alike, or a larger queue_size')
    return '; '.join([report, *remedies])
