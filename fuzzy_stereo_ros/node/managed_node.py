# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The node `disparity_node` with a life cycle, as Nav2's lifecycle manager brings nodes up."""
import gc
import sys
import traceback

from fuzzy_stereo_ros.memory import give_back_memory
from fuzzy_stereo_ros.node.disparity_node import DisparityNode
from fuzzy_stereo_ros.node.run_node import LOOK_SECONDS, NOT_ALLOWED, run_node
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn

SUCCESS, FAILURE, ERROR = (getattr(TransitionCallbackReturn, name)
                           for name in ('SUCCESS', 'FAILURE', 'ERROR'))


class ManagedDisparityNode(DisparityNode, LifecycleNode):
    """
    Matches as `DisparityNode` does, between the transitions activate and deactivate.

    configure advertises and warms up, and is done when a pair can be matched; cleanup gives back
    threads, memory and topics.
    """

    def begin(self):
        """Wait for the transitions."""

    def on_configure(self, state):
        """Advertise and warm up; FAILURE where that is not possible or ROS shuts down."""
        try:
            self.configure()
        except NOT_ALLOWED as error:
            self.get_logger().error(f'cannot be configured: {error}')
            self.release()
            return FAILURE
        while not self._ready.wait(LOOK_SECONDS):
            if not self.context.ok():
                return FAILURE
        return SUCCESS

    def on_activate(self, state):
        """Match from now on, while an output has a subscriber."""
        return self._done(self.activate)

    def on_deactivate(self, state):
        """Match no longer."""
        return self._done(self.deactivate)

    def on_cleanup(self, state):
        """Give back what `on_configure` took."""
        def free():
            self.release()
            gc.collect()        # threads end with the matcher that has them
            give_back_memory()

        return self._done(free)

    on_shutdown = on_error = on_cleanup

    def _done(self, work):
        """Return SUCCESS after some work, ERROR where it raises, which rclpy would not tell."""
        try:
            work()
        except Exception:       # noqa: B902  whatever it is, on_error is next
            self.get_logger().error(f'internal error: {traceback.format_exc().rstrip()}')
            return ERROR
        return SUCCESS


def main(arguments=None):
    """Run the managed node until SIGINT or SIGTERM and return its exit code."""
    return run_node(ManagedDisparityNode, sys.argv if arguments is None else arguments)


if __name__ == '__main__':
    sys.exit(main())
