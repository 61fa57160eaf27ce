# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The node `disparity_node`: stereo pairs come in by topics, disparities go out."""
from functools import partial
import os
import signal
import sys
import time

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from fuzzy_stereo_ros.matching import StereoMatcher, WARM_UP_SIZE
from fuzzy_stereo_ros.node_reports import (
    change_of, change_values, counts_of, Figures, kind_of, no_pair_report, Rates, Throttle,
    TopicState, trace, verdict)
from fuzzy_stereo_ros.pairs.messages import read_pair, stamp_of
from fuzzy_stereo_ros.pairs.result_messages import fill_confidence, fill_disparity
from fuzzy_stereo_ros.pairs.synchroniser import Synchroniser
from fuzzy_stereo_ros.parameter_table import in_ros_words
from fuzzy_stereo_ros.preparation import Preparation
from fuzzy_stereo_ros.ros_parameters import RosParameters
from fuzzy_stereo_ros.worker import Worker
import rclpy
from rclpy.clock import Clock, ClockType
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.exceptions import ParameterException
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import qos_policy_name_from_kind, QoSPolicyKind, QoSProfile
from rclpy.qos_overriding_options import QoSOverridingOptions
from sensor_msgs.msg import CameraInfo, CompressedImage, Image
from stereo_msgs.msg import DisparityImage

TOPICS = ('left/image_rect', 'left/camera_info', 'right/image_rect', 'right/camera_info')
OVERRIDABLE = (QoSPolicyKind.HISTORY, QoSPolicyKind.DEPTH, QoSPolicyKind.RELIABILITY,
               QoSPolicyKind.DURABILITY)
PATIENCE = 4.0      # s to wait at the end for a match or a compilation that still runs
BROKEN, REFUSED = 1, 2      # exit codes: something does not work, parameters are not allowed
NOT_ALLOWED = ValueError, RuntimeError, ParameterException     # by us, by ROS
FAST_DDS_VARIABLES = ('FASTRTPS_DEFAULT_PROFILES_FILE', 'FASTDDS_DEFAULT_PROFILES_FILE')


class DisparityNode(Node):
    """
    Synchronises four topics, has the newest pair matched, and publishes what comes out.

    Images are subscribed to only while an output has a subscriber. Matching runs in the worker
    of the process, so that the executor stays free.
    """

    def __init__(self, **options):
        """Declare parameters and outputs and start to warm up; ValueError for bad parameters."""
        super().__init__('disparity_node', **options)
        self.exit_code = 0
        self._declared = RosParameters(self, self._use)
        self._settings, self._config = self._declared.settings, self._declared.config
        self._preparation = Preparation(self._prepare, self._prepared)
        self._synchroniser = Synchroniser(
            TOPICS, self._settings['queue_size'], self._declared.tolerance())
        self._throttle, self._figures = Throttle(), Figures()
        self._matcher, self._forget, self._remarks = None, False, set()
        self._shape = WARM_UP_SIZE
        self._ready, self._inputs, self._incompatible = False, [], {}
        self._quiet_since, self._received_before, self._told_quiet = 0.0, {}, False
        self._rates = Rates(time.monotonic())
        self._disparity = self._output(DisparityImage, 'disparity')
        self._confidence = self._output(Image, 'confidence')
        self._diagnostics = self.create_publisher(DiagnosticArray, '/diagnostics', 1)
        # The steady clock: with use_sim_time and no /clock a timer of the node's never fires.
        self.create_timer(1.0, self._every_second, clock=Clock(clock_type=ClockType.STEADY_TIME))
        self._became_ready = self.create_guard_condition(self._serve)
        if self._declared.ignored:
            self.get_logger().warning(
                "parameters of stereo_image_proc's matchers that mean nothing here are ignored: "
                f"{', '.join(self._declared.ignored)}")
        self.get_logger().info('loading the kernels; the first start on a machine compiles '
                               'them, which takes up to 30 s')
        self._started = time.monotonic()
        self._worker = Worker.of_this_process()
        self._lane = self._worker.open_lane(self._match, self._failed)
        self._lane.call(self._warm_up)

    def destroy_node(self):
        """End matching for this node, then destroy it; return whether nothing runs any more."""
        last = time.monotonic() + PATIENCE
        ended = self._worker.close_lane(self._lane, PATIENCE)
        ended = self._preparation.close(max(last - time.monotonic(), 0)) and ended
        super().destroy_node()
        return ended

    def _output(self, kind, topic):
        return self.create_publisher(
            kind, topic, QoSProfile(depth=1),
            event_callbacks=PublisherEventCallbacks(matched=lambda event: self._serve()),
            qos_overriding_options=QoSOverridingOptions(OVERRIDABLE))

    def _give_up(self, code, sentence):
        self.get_logger().fatal(sentence)
        self.exit_code = code
        self.context.try_shutdown()

    def _use(self, config):
        """Match with another MatcherConfig once its kernels and its memory are there."""
        self._preparation.ask(config)

    # In the thread of the preparation.

    def _prepare(self, config):
        matcher = StereoMatcher(config)
        matcher.warm_up(*self._shape)
        return matcher

    def _prepared(self, config, error):
        if not self.context.ok():
            return      # it is the end that it failed of
        change = change_of(self._config, config)
        if error is None:
            self.get_logger().info(f'prepared, from the next pair on: {change}')
        else:
            self.get_logger().error(f'cannot be prepared: {change}: {trace(error)}')

    # In the worker's thread.

    def _warm_up(self):
        self._matcher = self._prepare(self._config)
        if not self.context.ok():
            return      # the end came first
        self._ready = True
        self.get_logger().info(
            f'ready: the kernels are warm after {time.monotonic() - self._started:.1f} s')
        self._became_ready.trigger()

    def _match(self, arrival):
        found, arrived = arrival
        forget, self._forget = self._forget, False
        self._matcher = self._preparation.take() or self._matcher
        config = self._config = self._matcher.config
        if forget:
            self._matcher.reset()
        pair = read_pair(*found.messages)
        for remark in pair.calibration.remarks:
            if kind_of(remark) not in self._remarks:
                self._remarks.add(kind_of(remark))
                self.get_logger().warning(remark)
        match = self._matcher.match(pair.left, pair.right, stamp=pair.stamp)
        self._shape = pair.left.shape[:2]
        if self._disparity.get_subscription_count():
            self._disparity.publish(fill_disparity(DisparityImage(), match, pair, config))
        if self._confidence.get_subscription_count():
            self._confidence.publish(fill_confidence(Image(), match, pair))
        self._figures.matched(match, 1000 * (time.monotonic() - arrived))

    def _failed(self, arrival, error):
        if not self.context.ok():
            return      # it is the end that it failed of
        if arrival is None:
            self._give_up(BROKEN, 'the kernels do not work here: ' + trace(error))
            return
        reason = getattr(error, 'reason', 'match')
        sentence = f'pair dropped: {in_ros_words(str(error))}'
        if not isinstance(error, ValueError):
            reason, sentence = 'fault', 'pair dropped by a fault of this package: ' + trace(error)
        self._figures.refuse(reason)
        line = self._throttle.note(sentence, time.monotonic())
        if line:
            self.get_logger().error(line)

    # In the executor's thread.

    def _serve(self):
        """Subscribe to the inputs while an output has a subscriber."""
        wanted = self._ready and self._subscribers()
        if wanted and not self._inputs:
            self._begin_quiet()
            self._incompatible.clear()
            try:
                self._inputs = [self._input(topic) for topic in TOPICS]
            except NOT_ALLOWED as error:
                self._give_up(REFUSED, f'cannot subscribe: {error}')
        elif self._inputs and not wanted:
            for subscription in self._inputs:
                self.destroy_subscription(subscription)
            self._inputs = []
            self._synchroniser.clear()

    def _subscribers(self):
        return (self._disparity.get_subscription_count()
                + self._confidence.get_subscription_count())

    def _input(self, topic):
        kind, name = CameraInfo, topic
        if topic.endswith('image_rect'):
            kind = Image
            if self._settings['image_transport'] == 'compressed':
                kind, name = CompressedImage, f'{self.resolve_topic_name(topic)}/compressed'
        return self.create_subscription(
            kind, name, partial(self._receive, topic),
            self._declared.input_qos(),
            event_callbacks=SubscriptionEventCallbacks(
                incompatible_qos=partial(self._note_incompatible, topic)),
            qos_overriding_options=QoSOverridingOptions(OVERRIDABLE))

    def _note_incompatible(self, topic, event):
        self._incompatible[topic] = qos_policy_name_from_kind(event.last_policy_kind).lower()
        self.get_logger().warning(
            f'a publisher of {self.resolve_topic_name(topic)} offers an incompatible QoS '
            f'({self._incompatible[topic]}); nothing arrives from it')

    def _receive(self, topic, message):
        for found in self._synchroniser.add(topic, stamp_of(message.header), message):
            if found.went_back:
                self._forget = True
                self.get_logger().info('the stamps went back: starting anew',
                                       throttle_duration_sec=5.0)
            self._begin_quiet()
            self._lane.offer((found, self._quiet_since))

    def _begin_quiet(self):
        self._quiet_since, self._told_quiet = time.monotonic(), False
        self._received_before = dict(self._synchroniser.received)

    def _every_second(self):
        now = time.monotonic()
        for line in self._throttle.due(now):
            self.get_logger().error(line)
        self._serve()
        quiet = now - self._quiet_since
        overdue = bool(self._inputs) and quiet > self._settings['no_pair_seconds']
        if overdue and not self._told_quiet:
            self._told_quiet = True
            self.get_logger().warning(self._why_quiet(quiet))
        self._diagnose(now, quiet if overdue else 0)

    def _why_quiet(self, seconds):
        topics = [
            TopicState(subscription.topic_name,
                       self._synchroniser.received[topic] - self._received_before[topic],
                       self.count_publishers(subscription.topic_name),
                       self._incompatible.get(topic, ''))
            for topic, subscription in zip(TOPICS, self._inputs)]
        return no_pair_report(
            seconds, topics, self._synchroniser.difference(), self._settings['approximate_sync'],
            any(os.environ.get(name) for name in FAST_DDS_VARIABLES))

    def _diagnose(self, now, quiet):
        counts = counts_of(self._synchroniser, self._lane.counts())
        rates = self._rates.since(now, counts)
        level, sentence = verdict(self._ready, bool(self._inputs), quiet, rates)
        values = {**counts,
                  **change_values(self._config, self._declared.config, self._preparation.state),
                  'input rate': f"{rates['pairs synchronised']:.1f} pairs/s",
                  'output rate': f"{rates['pairs matched']:.1f} pairs/s",
                  **self._figures.values()}
        status = DiagnosticStatus(
            level=getattr(DiagnosticStatus, level), message=sentence,
            name=f'{self.get_fully_qualified_name()}: stereo matching',
            hardware_id=self.get_fully_qualified_name(),
            values=[KeyValue(key=key, value=str(value)) for key, value in values.items()])
        message = DiagnosticArray(status=[status])
        message.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics.publish(message)


def main(arguments=None):
    """Run the node until SIGINT or SIGTERM and return its exit code."""
    node, code = None, 0
    try:
        rclpy.init(args=arguments)
    except RuntimeError as error:
        sys.stderr.write(f'disparity_node cannot start: {error}\n')
        return REFUSED
    try:
        executor = SingleThreadedExecutor()
        node = DisparityNode()
        executor.add_node(node)
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except Exception as error:      # noqa: B902  after a signal ROS fails in many ways
        if rclpy.ok():
            if node is not None or not isinstance(error, NOT_ALLOWED):
                raise
            sys.stderr.write(f'disparity_node cannot start: {error}\n')
            code = REFUSED
    # A second signal, as launch and a terminal send it, must not disturb the end.
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)
    ended = True
    if node is not None:
        code, ended = node.exit_code, node.destroy_node()
    rclpy.try_shutdown()
    if not (ended and Worker.of_this_process().stop(PATIENCE)):
        sys.stdout.flush()
        os._exit(code)      # a compilation cannot be interrupted, only left behind
    return code


if __name__ == '__main__':
    sys.exit(main())
