# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The managed (lifecycle) form of `disparity_node`, for lifecycle managers such as Nav2's."""
import gc
import sys
import traceback

from fuzzy_stereo_ros.node.disparity_node import DisparityNode
from fuzzy_stereo_ros.node.run_node import POLL_PERIOD, REJECTIONS, run_node
from fuzzy_stereo_ros.program import give_back_memory
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn

RESULT = TransitionCallbackReturn


class ManagedDisparityNode(DisparityNode, LifecycleNode):
    """
    Matches as `DisparityNode` does, between the transitions activate and deactivate.

    configure advertises the outputs and returns once the kernels are warm; cleanup frees threads,
    memory and topics.
    """

    def __init__(self, **options):
        """Declare parameters; ValueError for parameters that are not allowed."""
        super().__init__(**options)
        service = self._service_change_state
        self._change, service.callback = service.callback, self._change_if_allowed

    def start(self):
        """Do nothing: the transitions configure and activate the node."""

    def on_configure(self, state):
        """Advertise and warm up; FAILURE if parameters are not allowed or ROS shuts down."""
        try:
            self.configure()
        except REJECTIONS as error:
            self.get_logger().error(f'cannot be configured: {error}')
            self.release()
            return RESULT.FAILURE
        while not self._ready.wait(POLL_PERIOD):
            if not self.context.ok():
                return RESULT.FAILURE
        return RESULT.SUCCESS

    def on_activate(self, state):
        """Start matching, while an output has a subscriber."""
        return self._result_of(self.activate)

    def on_deactivate(self, state):
        """Stop matching."""
        return self._result_of(self.deactivate)

    def on_cleanup(self, state):
        """Free what `on_configure` made."""
        def free():
            self.release()
            gc.collect()        # ends the threads of matchers
            give_back_memory()

        return self._result_of(free)

    on_shutdown = on_error = on_cleanup

    def _change_if_allowed(self, request, response):
        """Answer a request for a transition; rclpy crashes on one invalid in this state."""
        asked, (_, state) = request.transition, self._state_machine.current_state
        allowed = {number: label
                   for number, label, *_ in self._state_machine.available_transitions}
        if asked.label or asked.id in allowed:
            return self._change(request, response)
        self.get_logger().warning(
            f'transition {asked.id} is not possible while the node is {state}; possible are '
            + (', '.join(f'{number} ({label})' for number, label in allowed.items()) or 'none'))
        response.success = False
        return response

    def _result_of(self, transition):
        """Return SUCCESS after a transition; log what it raises, as rclpy does not, and ERROR."""
        try:
            transition()
        except Exception:       # noqa: B902  on_error follows any error
            self.get_logger().error(f'internal error: {traceback.format_exc().rstrip()}')
            return RESULT.ERROR
        return RESULT.SUCCESS


def main(arguments=None):
    """Run the managed node until SIGINT or SIGTERM and return its exit code."""
    return run_node(ManagedDisparityNode, sys.argv if arguments is None else arguments)


if __name__ == '__main__':
    sys.exit(main())
