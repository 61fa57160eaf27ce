# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The node `disparity_node`: subscribe, synchronise, read, match, publish."""
from contextlib import ExitStack
from functools import wraps
import sys
import threading
import time
import traceback

from fuzzy_stereo_ros.matching.kernels.compiled import remarks
from fuzzy_stereo_ros.matching.plausibility import CONFIRMED, PlausibilityCheck
from fuzzy_stereo_ros.node.diagnostics import (
    change_of, counts_of, Diagnostics, LOADING, LossReports, State)
from fuzzy_stereo_ros.node.parameters import NodeParameters
from fuzzy_stereo_ros.node.publications import Publications
from fuzzy_stereo_ros.node.run_node import (
    BAD_INPUT, FAILED, REJECTIONS, run_node, SHUTDOWN_TIMEOUT)
from fuzzy_stereo_ros.node.services import Services
from fuzzy_stereo_ros.node.subscriptions import INFO_TOPICS, INPUT_TOPICS, Subscriptions
from fuzzy_stereo_ros.node.worker import Worker
from fuzzy_stereo_ros.pair_matcher import PairMatcher, PREPARING
from fuzzy_stereo_ros.pairs.messages import stamp_of
from fuzzy_stereo_ros.pairs.pair_reader import PairReader
from fuzzy_stereo_ros.pairs.stereo_pair import kind_of
from fuzzy_stereo_ros.pairs.synchroniser import Synchroniser
from fuzzy_stereo_ros.parameters.table import in_ros_words, sync_tolerance
from rclpy.clock import Clock, ClockType, JumpThreshold
from rclpy.duration import Duration
from rclpy.logging import get_logger
from rclpy.node import Node

LOG_PERIOD = 5.0    # s between two lines of one kind
REPORT_PERIOD = 1.0     # s between two diagnostics
MOST_LOGGERS = 100  # one for each kind of line; lines quote messages, so kinds have no end


class DisparityNode(Node):
    """
    Synchronises four topics, matches the newest pair, and publishes the results.

    It subscribes to the images only while an output has a subscriber. Matching runs in the
    worker's thread, so that the executor stays free.
    """

    def __init__(self, **options):
        """Declare parameters, and start; ValueError for parameters that are not allowed."""
        super().__init__('disparity_node', **options)
        self.exit_code, self._resources = 0, ExitStack()
        self._ready, self._active = threading.Event(), False
        self._worker = self._matcher = None     # until `configure`
        self._loggers, self._overrides_checked = {}, False
        self._declared = NodeParameters(
            self, lambda config: self._matcher and self._matcher.request(config),
            self._warn_of_ignored)
        self._warn_of_ignored(self._declared.ignored)
        self._warn_of('unknown parameters are ignored: ', self._declared.unknown)
        self.start()

    def create_service(self, kind, name, callback, **options):
        """Return a service that survives requests which make its callback fail."""
        return super().create_service(kind, name, self._surviving(name, callback), **options)

    def create_subscription(self, kind, topic, callback, *qos, **options):
        """Return a subscription that survives messages which make its callback fail."""
        return super().create_subscription(
            kind, topic, self._surviving(topic, callback), *qos, **options)

    def start(self):
        """Configure and activate the node; a managed node waits for its transitions instead."""
        self.configure()
        self.activate()

    def configure(self):
        """Advertise the outputs and start to warm up; one of REJECTIONS for a wrong QoS."""
        self._started, self._loading = time.monotonic(), LOADING
        settings, resources = self._declared.settings, self._resources
        self._synchroniser = Synchroniser(
            INPUT_TOPICS, settings['queue_size'], sync_tolerance(settings),
            cached=INFO_TOPICS if settings['cache_camera_info'] else ())
        self._inputs = Subscriptions(self, settings, self._synchroniser, self._receive)
        self._reader = PairReader(settings['rectify'], settings['crop'], settings['scale'])
        self._matcher = PairMatcher(
            self._declared.config, settings['scale'], self._log_prepared)
        self._outputs = Publications(self, settings, self._update_subscriptions)
        resources.callback(self._outputs.close)
        self._plausibility = PlausibilityCheck(CONFIRMED, settings['scale'])
        self._warned_of = ''        # cause of the newest Finding that was logged
        self._diagnostics, self._losses = Diagnostics(self, self._started), LossReports()
        resources.callback(self._diagnostics.close)
        resources.callback(Services(
            self, self._matcher, settings['save_directory'], settings['max_saved_pairs'],
            self._describe).close)
        # With use_sim_time and no /clock a timer on the node's clock never fires.
        resources.callback(self.destroy_timer, self.create_timer(
            REPORT_PERIOD, self._every_second, clock=Clock(clock_type=ClockType.STEADY_TIME)))
        resources.callback(self.get_clock().create_jump_callback(
            JumpThreshold(min_forward=None, min_backward=Duration(nanoseconds=-1),
                          on_clock_change=False),
            post_callback=self._clock_jumped_back).unregister)
        self._log_kernel_warnings()
        self.get_logger().info('loading the kernels; the first start on a machine compiles '
                               'them, which takes up to 60 s')
        self._worker = Worker(self._warm_up, self._match, self._handle_error)

    def activate(self):
        """Subscribe to the inputs while an output has a subscriber, once the kernels are warm."""
        self._active = True
        self._update_subscriptions()

    def deactivate(self):
        """End the subscriptions; the pair being matched is not published."""
        self._active = False
        self._update_subscriptions()

    def release(self, timeout=None):
        """Stop matching, free what `configure` made; return whether all threads ended."""
        self._active, ended = False, True
        if self._worker is not None:
            end = None if timeout is None else time.monotonic() + timeout
            counts = self._counts()     # before `close` drops the waiting pair
            ended = self._worker.close(timeout)
            self._log_kernel_warnings()
            self._log_losses(time.monotonic(), counts, last=True)
            self._inputs.update(False)
            ended = self._matcher.close(end and max(end - time.monotonic(), 0)) and ended
        self._resources.close()
        self._ready.clear()
        self._worker = self._matcher = None
        return ended

    def destroy_node(self):
        """Stop matching and destroy the node; return whether all its threads have ended."""
        ended = self.release(SHUTDOWN_TIMEOUT)
        super().destroy_node()
        return ended

    # The path of a frame: `_receive` runs in the executor's thread, `_match` in the worker's.

    def _receive(self, topic, message):
        """Synchronise a message, and submit the pair that it completes to the worker."""
        for matched_set in self._synchroniser.add(topic, stamp_of(message.header), message):
            self._inputs.note_pair()
            if matched_set.went_back:
                self._matcher.reset()
                self.get_logger().info('timestamps jumped back; the next pair is matched '
                                       'without the previous frame',
                                       throttle_duration_sec=LOG_PERIOD)
            self._worker.submit((matched_set, time.monotonic()))

    def _match(self, item):
        """Read, match and publish a MatchedSet that arrived at a time in s."""
        matched_set, arrived = item
        pair = self._reader.read(*matched_set.messages)
        self._diagnostics.calibration = pair.calibration
        for remark in pair.calibration.remarks:
            self._log_once(remark)
        matched = self._matcher.match(pair)
        if not self._active:
            return
        self._outputs.publish(matched)
        self._diagnostics.matched(matched.match, **{
            'latency': 1000 * (time.monotonic() - arrived),
            'age': (self.get_clock().now().nanoseconds - matched_set.stamp) / 1e6,
            'stamps apart': matched_set.spread / 1e6})
        self._plausibility.add_within_share(
            pair.left, pair.right, matched.match, matched.config, pair.calibration.offset)

    # Also in the worker's thread; `_log_prepared` runs in the thread that prepares matchers.

    def _warm_up(self):
        self._matcher.warm_up(self._log_compiling)
        self._plausibility.warm_up()
        if not self.context.ok():
            return      # shutting down
        self._ready.set()
        self.get_logger().info(
            f'ready: the kernels are warm after {time.monotonic() - self._started:.1f} s')
        if self.executor is not None:       # else the timer subscribes, once there is one
            self.executor.create_task(self._update_subscriptions)

    def _log_compiling(self, progress):
        if not self.context.ok():
            return      # shutting down
        percent, left = f'{100 * progress.share:.0f}', progress.left
        self._loading = f'compiling the kernels: {percent} %' if left is None else (
            f'compiling the kernels: {percent} %, about {left:.0f} s left')
        self.get_logger().info(self._loading, throttle_duration_sec=LOG_PERIOD)

    def _handle_error(self, item, error):
        """Reject a pair whose processing raised an exception; end the node if warm-up did."""
        if not self.context.ok():
            return      # shutting down
        trace = ''.join(traceback.format_exception(error)).rstrip()
        if item is None:
            self._shut_down(FAILED, f'kernel warm-up failed: {trace}')
            return
        reason, sentence = getattr(error, 'reason', 'match'), in_ros_words(str(error))
        if not isinstance(error, ValueError):
            reason, sentence = 'fault', f'internal error: {trace}'
        self._diagnostics.reject(reason, sentence.splitlines()[-1])
        self._plausibility.interrupt()
        self._logger_of(sentence).error(f'pair rejected: {sentence}',
                                        throttle_duration_sec=LOG_PERIOD)

    def _log_prepared(self, config, error):
        if not self.context.ok():
            return      # shutting down
        change = change_of(self._matcher.config, config)
        if error is None:
            self.get_logger().info(f'prepared, from the next pair on: {change}')
        else:
            trace = ''.join(traceback.format_exception(error)).rstrip()
            self.get_logger().error(f'cannot be prepared: {change}: {trace}')

    # In the executor's thread.

    def _update_subscriptions(self):
        """Subscribe to the inputs if an output has a subscriber, else end the subscriptions."""
        try:
            self._inputs.update(
                self._active and self._ready.is_set() and self._outputs.wanted())
        except REJECTIONS as error:
            if self.context.ok():
                self._shut_down(BAD_INPUT, f'cannot subscribe: {error}')
            return
        if self._inputs and not self._overrides_checked:
            self._overrides_checked = True      # subscribing has declared those of the inputs
            self._warn_of('QoS overrides for unknown topics are ignored: ',
                          self._declared.unused_overrides())

    def _clock_jumped_back(self, jump):
        self._matcher.reset()
        self.get_logger().info('the clock jumped back; the next pair is matched without the '
                               'previous frame')

    def _every_second(self):
        now, counts = time.monotonic(), self._counts()
        self._log_kernel_warnings()
        self._log_losses(now, counts)
        self._update_subscriptions()
        report = self._inputs.report(now)
        if report:
            self.get_logger().warning(report)
        silence = self._inputs.seconds_without_pair(now)
        if self._inputs.misses_pairs() or silence or not self._inputs:
            self._plausibility.interrupt()
        matcher = self._matcher
        state, change, idle = matcher.change, 'none', ''
        finding = self._plausibility.finding
        if finding is not None and finding.cause == 'deadline' and state == PREPARING:
            finding = None
        self._log_finding(finding)
        if state:
            change = f'{state}: {change_of(matcher.config, self._declared.config)}'
        if not self._inputs:
            idle = 'idle: no output has a subscriber' if self._active else 'idle: not activated'
        doubt = self._diagnostics.publish(
            now, counts, {'disparity_range in use': str(matcher.config.disparities),
                          'change of parameters': change},
            State('' if self._ready.is_set() else self._loading, idle, silence,
                  state == PREPARING), finding, self._outputs.left_out)
        if doubt:
            self._log_once(doubt)

    def _counts(self):
        return counts_of(self._synchroniser, self._worker.counts(), self._inputs.lost)

    def _surviving(self, name, callback):
        """Return a callback that logs what it raises; rclpy's own would end the process."""
        @wraps(callback)
        def call(*arguments):
            try:
                return callback(*arguments)
            except Exception as error:      # noqa: B902  rclpy fails in many ways
                if not self.context.ok():
                    raise       # shutting down
                reason = error if isinstance(error, ValueError) else traceback.format_exc()
                self._logger_of(name).error(f'message on {name} rejected: {reason}',
                                            throttle_duration_sec=LOG_PERIOD)
                return arguments[-1]    # the response as it is, for a service
        return call

    def _shut_down(self, exit_code, sentence):
        self.get_logger().fatal(sentence)
        self.exit_code = exit_code
        self.context.try_shutdown()

    def _logger_of(self, sentence):
        """Return the logger of all sentences of a kind, as rclpy throttles by the logger."""
        kind = kind_of(sentence)
        if kind not in self._loggers and len(self._loggers) >= MOST_LOGGERS:
            kind = ''
        return self._loggers.setdefault(kind, get_logger(self.get_logger().name))

    def _log_once(self, sentence):
        self._logger_of(sentence).warning(sentence, once=True)

    def _log_finding(self, finding):
        """Warn of a Finding, or None, once, and again if it returns after it went away."""
        cause = finding.cause if finding is not None and finding.warns else ''
        if cause not in ('', self._warned_of):
            self.get_logger().warning(finding.sentence)
        self._warned_of = cause

    def _warn_of(self, sentence, names):
        if names:
            self.get_logger().warning(sentence + ', '.join(names))

    def _warn_of_ignored(self, names):
        self._warn_of("parameters of stereo_image_proc's matchers are ignored: ", names)

    def _log_kernel_warnings(self):
        for remark in remarks():
            self.get_logger().warning(remark)

    def _log_losses(self, now, counts, last=False):
        # Once ROS has shut down, the logger of a node complains that it cannot reach /rosout.
        logger = self.get_logger() if self.context.ok() else get_logger(f'{self.get_name()}.end')
        for line in self._losses.lines(now, counts, last):
            logger.info(line)

    def _describe(self):
        """Return {key: text} of all parameters and the newest diagnostics, for the saved pair."""
        parameters = self.get_parameters_by_prefix('').items()
        return {**{f'parameter {name}': str(one.value) for name, one in parameters
                   if one.value is not None}, **self._diagnostics.values}


def main(arguments=None):
    """Run the node until SIGINT or SIGTERM and return its exit code."""
    return run_node(DisparityNode, sys.argv if arguments is None else arguments)


if __name__ == '__main__':
    sys.exit(main())
