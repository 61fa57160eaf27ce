# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The node `disparity_node`: stereo pairs come in by topics, disparities go out."""
import sys
import time

from fuzzy_stereo_ros.matching.kernels.keeping import remarks
from fuzzy_stereo_ros.node.diagnostics import Diagnosis
from fuzzy_stereo_ros.node.inputs import Inputs
from fuzzy_stereo_ros.node.losses import Losses
from fuzzy_stereo_ros.node.outputs import Outputs
from fuzzy_stereo_ros.node.parameters import RosParameters
from fuzzy_stereo_ros.node.run_node import BROKEN, live, NOT_ALLOWED, PATIENCE, REFUSED
from fuzzy_stereo_ros.node.services import Services
from fuzzy_stereo_ros.node.worker import Worker
from fuzzy_stereo_ros.pair_matcher import Rig
from fuzzy_stereo_ros.pairs.pair_reader import PairReader
from fuzzy_stereo_ros.parameters.table import in_ros_words
from fuzzy_stereo_ros.reports import (
    change_of, change_values, counts_of, Figures, kind_of, Throttle, trace)
from rclpy.clock import Clock, ClockType, JumpThreshold
from rclpy.duration import Duration
from rclpy.node import Node


class DisparityNode(Node):
    """
    Synchronises four topics, has the newest pair matched, and publishes what comes out.

    Images are subscribed to only while an output has a subscriber. Matching runs in the worker
    of the process, so that the executor stays free.
    """

    def __init__(self, **options):
        """Declare parameters and outputs and start to warm up; ValueError for bad parameters."""
        super().__init__('disparity_node', **options)
        self.exit_code, self._ready, self._started = 0, False, time.monotonic()
        self._declared = RosParameters(
            self, lambda config: self._rig.use(config), self._warn_of_ignored)
        settings = self._declared.settings
        reader = PairReader(settings['rectify'], settings['crop'], settings['scale'])
        self._rig = Rig(self._declared.config, reader, self._prepared)
        self._throttle, self._losses = Throttle(), Losses()
        self._figures, self._remarks = Figures(), set()
        self._overrides_checked = False     # the inputs have theirs when they are subscribed to
        self._inputs = Inputs(self, settings, self._declared.tolerance(), self._take)
        self._outputs = Outputs(self, settings, self._serve)
        self._diagnosis = Diagnosis(self, self._started)
        Services(self, self._rig, settings['save_directory'], self._about)
        # The steady clock: with use_sim_time and no /clock a timer of the node's never fires.
        self.create_timer(1.0, self._every_second, clock=Clock(clock_type=ClockType.STEADY_TIME))
        self._jumps = self.get_clock().create_jump_callback(
            JumpThreshold(min_forward=None, min_backward=Duration(nanoseconds=-1),
                          on_clock_change=False),
            post_callback=self._clock_went_back)
        self._became_ready = self.create_guard_condition(self._serve)
        self._warn_of_ignored(self._declared.ignored)
        self._warn_of('no parameters of this node are called so, and they change nothing: ',
                      self._declared.unknown)
        self._tell_remarks()
        self.get_logger().info('loading the kernels; the first start on a machine compiles '
                               'them, which takes up to 60 s')
        self._worker = Worker.of_this_process()
        self._lane = self._worker.open_lane(self._match, self._failed)
        self._lane.call(self._warm_up)

    def destroy_node(self):
        """End matching for this node, then destroy it; return whether nothing runs any more."""
        last = time.monotonic() + PATIENCE
        counts = self._counts()     # what still waits is not lost but ended
        ended = self._worker.close_lane(self._lane, PATIENCE)
        self._tell_remarks()
        self._tell_losses(time.monotonic(), counts, last=True)
        ended = self._rig.close(max(last - time.monotonic(), 0)) and ended
        self._jumps.unregister()
        super().destroy_node()
        return ended

    def _give_up(self, code, sentence):
        self.get_logger().fatal(sentence)
        self.exit_code = code
        self.context.try_shutdown()

    # In the thread of the preparation.

    def _prepared(self, config, error):
        if not self.context.ok():
            return      # it is the end that it failed of
        change = change_of(self._rig.config, config)
        if error is None:
            self.get_logger().info(f'prepared, from the next pair on: {change}')
        else:
            self.get_logger().error(f'cannot be prepared: {change}: {trace(error)}')

    # In the worker's thread.

    def _warm_up(self):
        self._rig.warm_up()
        if not self.context.ok():
            return      # the end came first
        self._ready = True
        self.get_logger().info(
            f'ready: the kernels are warm after {time.monotonic() - self._started:.1f} s')
        self._became_ready.trigger()

    def _match(self, arrival):
        found, arrived = arrival
        matched = self._rig.match(found.messages)
        for remark in matched.pair.calibration.remarks:
            if kind_of(remark) not in self._remarks:
                self._remarks.add(kind_of(remark))
                self.get_logger().warning(remark)
        self._outputs.publish(matched)
        self._figures.matched(matched.match, **{
            'latency': 1000 * (time.monotonic() - arrived),
            'age': (self.get_clock().now().nanoseconds - found.stamp) / 1e6,
            'stamps apart': found.spread / 1e6})

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
        try:
            self._inputs.serve(self._ready and self._outputs.wanted())
        except NOT_ALLOWED as error:
            if not self.context.ok():
                return      # it is the end that it failed of
            self._give_up(REFUSED, f'cannot subscribe: {error}')
            return
        if self._inputs and not self._overrides_checked:
            self._overrides_checked = True
            self._warn_of('no topic of this node has these QoS, and they change nothing: ',
                          self._declared.unused_overrides())

    def _take(self, found, arrived):
        if found.went_back:
            self._rig.forget()
            self.get_logger().info('the stamps went back: starting anew',
                                   throttle_duration_sec=5.0)
        self._lane.offer((found, arrived))

    def _clock_went_back(self, jump):
        self._rig.forget()
        self.get_logger().info('the clock went back: starting anew')

    def _every_second(self):
        now, counts = time.monotonic(), self._counts()
        self._tell_remarks()
        self._tell_losses(now, counts)
        self._serve()
        report = self._inputs.report(now)
        if report:
            self.get_logger().warning(report)
        self._diagnosis.publish(
            now, counts,
            {**change_values(self._rig.config, self._declared.config, self._rig.state_of_change),
             **self._figures.values()},
            self._ready, bool(self._inputs), self._inputs.quiet(now))

    def _counts(self):
        return counts_of(
            self._inputs.synchroniser, self._lane.counts(), self._inputs.lost)

    def _warn_of(self, sentence, names):
        if names:
            self.get_logger().warning(sentence + ', '.join(names))

    def _warn_of_ignored(self, names):
        self._warn_of("parameters of stereo_image_proc's matchers that mean nothing here are "
                      'ignored: ', names)

    def _tell_remarks(self):
        for remark in remarks():
            self.get_logger().warning(remark)

    def _tell_losses(self, now, counts, last=False):
        for line in self._throttle.due(now, last):
            self.get_logger().error(line)
        for line in self._losses.lines(now, counts, last):
            self.get_logger().info(line)

    def _about(self):
        """Return {key: text} of all parameters and the newest diagnostics, for the saved pair."""
        parameters = self.get_parameters_by_prefix('').items()
        return {**{f'parameter {name}': str(one.value) for name, one in parameters
                   if one.value is not None}, **self._diagnosis.values}


def main(arguments=None):
    """Run the node until SIGINT or SIGTERM and return its exit code."""
    return live(DisparityNode, sys.argv if arguments is None else arguments)


if __name__ == '__main__':
    sys.exit(main())
