# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The node `disparity_node`: subscribe, synchronise, read, match, publish."""
from contextlib import ExitStack
import sys
import threading
import time
import traceback

from fuzzy_stereo_ros.matching.kernels.compiled import remarks
from fuzzy_stereo_ros.node.diagnostics import (
    change_of, counts_of, Diagnostics, LOADING, LossReports)
from fuzzy_stereo_ros.node.parameters import NodeParameters
from fuzzy_stereo_ros.node.publications import Publications
from fuzzy_stereo_ros.node.run_node import (
    BROKEN, NOT_ALLOWED, REJECTED, run_node, SHUTDOWN_TIMEOUT)
from fuzzy_stereo_ros.node.services import Services
from fuzzy_stereo_ros.node.subscriptions import Subscriptions, TOPICS
from fuzzy_stereo_ros.node.worker import Worker
from fuzzy_stereo_ros.pair_matcher import PairMatcher
from fuzzy_stereo_ros.pairs.epipolar import EpipolarCheck
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
MOST_KINDS = 100    # of lines: sentences quote messages, which may differ without end


class DisparityNode(Node):
    """
    Synchronises four topics, matches the newest pair, and publishes the results.

    Images are subscribed to only while an output has a subscriber. Matching runs in the worker's
    thread, so that the executor stays free.
    """

    def __init__(self, **options):
        """Declare parameters, and begin; ValueError for parameters that are not allowed."""
        super().__init__('disparity_node', **options)
        self.exit_code, self._held = 0, ExitStack()
        self._ready, self._active = threading.Event(), False
        self._worker = self._matcher = None     # what `configure` makes
        self._loggers, self._overrides_checked = {}, False
        self._declared = NodeParameters(
            self, lambda config: self._matcher and self._matcher.request(config),
            self._warn_of_ignored)
        self._warn_of_ignored(self._declared.ignored)
        self._warn_of('unknown parameters are ignored: ', self._declared.unknown)
        self.begin()

    def begin(self):
        """Do at the start what leads to matching: here all of it."""
        self.configure()
        self.activate()

    def configure(self):
        """Advertise, and start to warm up; ValueError or an error of ROS for a wrong QoS."""
        self._started, self._loading = time.monotonic(), LOADING
        settings, held = self._declared.settings, self._held
        self._synchroniser = Synchroniser(
            TOPICS, settings['queue_size'], sync_tolerance(settings),
            held=TOPICS[1::2] if settings['cache_camera_info'] else ())
        self._inputs = Subscriptions(self, settings, self._synchroniser, self._receive)
        self._reader = PairReader(settings['rectify'], settings['crop'], settings['scale'])
        self._matcher = PairMatcher(
            self._declared.config, settings['scale'], self._log_prepared)
        self._outputs = Publications(self, settings, self._serve)
        held.callback(self._outputs.close)
        self._diagnostics, self._losses = Diagnostics(self, self._started), LossReports()
        held.callback(self._diagnostics.close)
        self._epipolar = EpipolarCheck()
        held.callback(Services(self, self._matcher, settings['save_directory'], self._about).close)
        # The steady clock: with use_sim_time and no /clock a timer of the node's never fires.
        held.callback(self.destroy_timer, self.create_timer(
            1.0, self._every_second, clock=Clock(clock_type=ClockType.STEADY_TIME)))
        held.callback(self.get_clock().create_jump_callback(
            JumpThreshold(min_forward=None, min_backward=Duration(nanoseconds=-1),
                          on_clock_change=False),
            post_callback=self._clock_jumped_back).unregister)
        self._log_kernel_warnings()
        self.get_logger().info('loading the kernels; the first start on a machine compiles '
                               'them, which takes up to 60 s')
        self._worker = Worker(self._warm_up, self._match, self._fail)

    def activate(self):
        """Subscribe to the inputs while an output has a subscriber, as soon as all is warm."""
        self._active = True
        self._serve()

    def deactivate(self):
        """End the subscriptions; what is being matched is not published."""
        self._active = False
        self._serve()

    def release(self, timeout=None):
        """
        End matching and give back what `configure` made; return whether all threads have ended.

        timeout: s to wait for a match or a compilation that still runs; None = until done.
        """
        self._active, ended = False, True
        if self._worker is not None:
            end = None if timeout is None else time.monotonic() + timeout
            counts = self._counts()     # a pair that still waits is not dropped for a newer one
            ended = self._worker.close(timeout)
            self._log_kernel_warnings()
            self._log_losses(time.monotonic(), counts, last=True)
            self._inputs.serve(False)
            ended = self._matcher.close(end and max(end - time.monotonic(), 0)) and ended
        self._held.close()
        self._ready.clear()
        self._worker = self._matcher = None
        return ended

    def destroy_node(self):
        """End matching, then destroy the node; return whether all its threads have ended."""
        ended = self.release(SHUTDOWN_TIMEOUT)
        super().destroy_node()
        return ended

    # A frame: subscribe and synchronise in the executor's thread; the rest in the worker's.

    def _receive(self, topic, message):
        for found in self._synchroniser.add(topic, stamp_of(message.header), message):
            self._inputs.note_pair()
            if found.went_back:
                self._matcher.reset()
                self.get_logger().info('timestamps jumped back; the next pair is matched '
                                       'without the previous frame',
                                       throttle_duration_sec=LOG_PERIOD)
            self._worker.submit((found, time.monotonic()))

    def _match(self, arrival):
        found, arrived = arrival
        pair = self._reader.read(*found.messages)
        for remark in pair.calibration.remarks:
            self._log_once(remark)
        matched = self._matcher.match(pair)
        if not self._active:
            return
        self._outputs.publish(matched)
        self._diagnostics.matched(matched.match, **{
            'latency': 1000 * (time.monotonic() - arrived),
            'age': (self.get_clock().now().nanoseconds - found.stamp) / 1e6,
            'stamps apart': found.spread / 1e6})
        self._epipolar.watch(pair, matched.match, matched.config.reference)

    # The rest of the worker's thread, and that of the preparation.

    def _warm_up(self):
        self._matcher.warm_up(self._report)
        self._epipolar.warm_up()
        if not self.context.ok():
            return      # shutting down
        self._ready.set()
        self.get_logger().info(
            f'ready: the kernels are warm after {time.monotonic() - self._started:.1f} s')
        if self.executor is not None:       # else the timer serves, once there is one
            self.executor.create_task(self._serve)

    def _report(self, progress):
        if not self.context.ok():
            return      # shutting down
        percent, left = f'{100 * progress.share:.0f}', progress.left
        self._loading = f'compiling the kernels: {percent} %' if left is None else (
            f'compiling the kernels: {percent} %, about {left:.0f} s left')
        self.get_logger().info(self._loading, throttle_duration_sec=LOG_PERIOD)

    def _fail(self, arrival, error):
        if not self.context.ok():
            return      # shutting down
        trace = ''.join(traceback.format_exception(error)).rstrip()
        if arrival is None:
            self._give_up(BROKEN, f'kernel warm-up failed: {trace}')
            return
        reason, sentence = getattr(error, 'reason', 'match'), in_ros_words(str(error))
        if not isinstance(error, ValueError):
            reason, sentence = 'fault', f'internal error: {trace}'
        self._diagnostics.reject(reason)
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

    # The rest of the executor's thread.

    def _serve(self):
        """Subscribe to the inputs while an output has a subscriber."""
        try:
            self._inputs.serve(
                self._active and self._ready.is_set() and self._outputs.wanted())
        except NOT_ALLOWED as error:
            if self.context.ok():
                self._give_up(REJECTED, f'cannot subscribe: {error}')
            return
        if self._inputs and not self._overrides_checked:
            self._overrides_checked = True      # those of the inputs are declared by now
            self._warn_of('no topic of this node has these QoS, they are ignored: ',
                          self._declared.unused_overrides())

    def _clock_jumped_back(self, jump):
        self._matcher.reset()
        self.get_logger().info('the clock jumped back; the next pair is matched without the '
                               'previous frame')

    def _every_second(self):
        now, counts = time.monotonic(), self._counts()
        self._log_kernel_warnings()
        self._log_losses(now, counts)
        self._serve()
        report = self._inputs.report(now)
        if report:
            self.get_logger().warning(report)
        matcher, misalignment = self._matcher, self._epipolar.misalignment
        if misalignment is not None and misalignment.advice:
            self._log_once(misalignment.advice)
        state, change, idle = matcher.change, 'none', ''
        if state:
            change = f'{state}: {change_of(matcher.config, self._declared.config)}'
        if not self._inputs:
            idle = 'idle: no output has a subscriber' if self._active else 'idle: not activated'
        self._diagnostics.publish(
            now, counts, {'disparity_range in use': str(matcher.config.disparities),
                          'change of parameters': change},
            '' if self._ready.is_set() else self._loading, idle,
            self._inputs.seconds_without_pair(now), misalignment)

    def _counts(self):
        return counts_of(self._synchroniser, self._worker.counts(), self._inputs.lost)

    def _give_up(self, code, sentence):
        self.get_logger().fatal(sentence)
        self.exit_code = code
        self.context.try_shutdown()

    def _logger_of(self, sentence):
        """Return the logger of sentences that differ only in numbers: rclpy throttles by it."""
        kind = kind_of(sentence)
        if kind not in self._loggers and len(self._loggers) >= MOST_KINDS:
            kind = ''
        return self._loggers.setdefault(kind, get_logger(self.get_logger().name))

    def _log_once(self, sentence):
        self._logger_of(sentence).warning(sentence, once=True)

    def _warn_of(self, sentence, names):
        if names:
            self.get_logger().warning(sentence + ', '.join(names))

    def _warn_of_ignored(self, names):
        self._warn_of("parameters of stereo_image_proc's matchers that mean nothing here are "
                      'ignored: ', names)

    def _log_kernel_warnings(self):
        for remark in remarks():
            self.get_logger().warning(remark)

    def _log_losses(self, now, counts, last=False):
        for line in self._losses.lines(now, counts, last):
            self.get_logger().info(line)

    def _about(self):
        """Return {key: text} of all parameters and the newest diagnostics, for the saved pair."""
        parameters = self.get_parameters_by_prefix('').items()
        return {**{f'parameter {name}': str(one.value) for name, one in parameters
                   if one.value is not None}, **self._diagnostics.values}


def main(arguments=None):
    """Run the node until SIGINT or SIGTERM and return its exit code."""
    return run_node(DisparityNode, sys.argv if arguments is None else arguments)


if __name__ == '__main__':
    sys.exit(main())
