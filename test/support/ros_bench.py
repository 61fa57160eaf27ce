# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The real node in its own process between simulated cameras and a listener, all over real DDS."""
import time

from diagnostic_msgs.msg import DiagnosticArray
from fuzzy_stereo_ros.node.simulated_cameras import SimulatedCameras
from fuzzy_stereo_ros.pairs.messages import stamp_of
from node_process import DISPARITY_NODE, NodeProcess, SOON, START
from rcl_interfaces.srv import DescribeParameters, GetParameters, SetParametersAtomically
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter, parameter_value_to_python
from sensor_msgs.msg import Image
from std_srvs.srv import Trigger
from stereo_msgs.msg import DisparityImage

FOCAL, BASELINE = 200.0, 0.12
SECOND = 1_000_000_000
NODE = '/disparity_node'
RELIABLE = '--ros-args', '-p', 'input_qos:=reliable'


def values_in(message):
    """Return {key: text} of all that a DiagnosticArray of the node tells."""
    return {value.key: value.value for status in message.status for value in status.values}


def uncalibrate(messages):
    """Let the cameras of a pair say what those of stereo_image_proc's own launch test say."""
    for side in ('left', 'right'):
        info = messages[f'{side}/camera_info']
        info.k, info.d = 9 * [0.0], []
        info.p = [1.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]


class Surroundings:
    """Simulated cameras and a listener: publishes pairs, collects answers, awaits events."""

    def __init__(self, domain, **rig):
        """Join a domain; rig: options of the SimulatedCameras."""
        self.domain, self.context = domain, rclpy.Context()
        rclpy.init(context=self.context, domain_id=domain)
        self.rig = SimulatedCameras(f'rig_{domain}', FOCAL, BASELINE, context=self.context, **rig)
        self.listener = rclpy.create_node(f'listener_{domain}', context=self.context)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.rig)
        self.executor.add_node(self.listener)
        self.disparities, self.confidences, self.diagnostics = {}, {}, []
        self.listener.create_subscription(
            DiagnosticArray, '/diagnostics', self.diagnostics.append, 10)
        self.subscriptions = []

    def close(self):
        """Leave the domain."""
        self.executor.shutdown()
        self.rig.destroy_node()
        self.listener.destroy_node()
        rclpy.shutdown(context=self.context)

    def check(self):
        """Raise AssertionError where it makes no sense to wait any longer."""

    def heard(self):
        """Return what was heard last of the node's diagnostics, for a failed test's report."""
        return '\n'.join(f'{key}: {value}' for message in self.diagnostics[-1:]
                         for key, value in values_in(message).items())

    def listen(self, disparity=True, confidence=True, namespace=''):
        """Subscribe to the outputs."""
        if disparity:
            self.collect(DisparityImage, f'{namespace}disparity', self.disparities)
        if confidence:
            self.collect(Image, f'{namespace}confidence', self.confidences)

    def collect(self, kind, topic, messages, quality=10):
        """Subscribe to a topic and put its messages into a dict, by stamp."""
        def put(message):
            messages[stamp_of(message.header)] = message

        self.subscriptions.append(
            self.listener.create_subscription(kind, topic, put, quality))

    def leave(self):
        """Take back the subscriptions to the outputs."""
        while self.subscriptions:
            self.listener.destroy_subscription(self.subscriptions.pop())

    def until(self, condition, what, timeout=SOON):
        """Spin until condition() is true and return its value."""
        deadline = time.monotonic() + timeout
        while not (value := condition()):
            assert time.monotonic() < deadline, f'never: {what}\n{self.heard()}'
            self.check()
            self.executor.spin_once(timeout_sec=0.05)
        return value

    def answer(self, client, request, timeout=SOON, again=5):
        """Return what a service answers; it is asked anew every `again` s that it says nothing."""
        # The first answer is lost where the service has not yet heard of its client: DDS tells the
        # two sides of a new connection one after the other.
        self.until(client.service_is_ready, client.srv_name, timeout)
        asked = {}

        def answered():
            if not asked or time.monotonic() - max(asked) > again:
                asked[time.monotonic()] = client.call_async(request)
            return next((future for future in asked.values() if future.done()), None)

        return self.until(answered, f'answer of {client.srv_name}', timeout).result()

    def parameters(self, *names, node=NODE):
        """Return the values of parameters of a node, None for those that are not set."""
        request = GetParameters.Request(names=names)
        answer = self._ask(GetParameters, 'get_parameters', request, node)
        return [parameter_value_to_python(value) for value in answer.values]

    def _ask(self, kind, name, request, node=NODE, **options):
        client = self.listener.create_client(kind, f'{node}/{name}')
        try:
            return self.answer(client, request, **options)
        finally:
            self.listener.destroy_client(client)

    def match(self, left, right, stamp=None, change=None):
        """Publish a pair and return the DisparityImage that comes of it."""
        sent = self.rig.publish(left, right, stamp, change)
        return self.until(lambda: self.disparities.pop(sent, None), f'disparity of {sent}')

    def first_match(self, left, right, change=None):
        """Return the DisparityImage of the first pair that gets through."""
        # DDS tells the two sides of a new connection one after the other; what is sent between
        # is lost without QoS reliable.
        sent = set()

        def answer():
            if not sent or time.time_ns() - max(sent) > SECOND // 2:
                sent.add(self.rig.publish(left, right, change=change))
            return next((self.disparities[stamp] for stamp in sent & set(self.disparities)), None)

        return self.until(answer, 'a first disparity')


class Bench(Surroundings):
    """The real node in its own process, in these surroundings."""

    def __init__(self, domain, *arguments, best_effort=False, module=DISPARITY_NODE, **rig):
        """
        Start the module's node in a domain with command-line arguments; rig: of SimulatedCameras.

        best_effort: as between real cameras and the node's defaults, where DDS may lose a message
        on a busy machine; else nothing is lost.
        """
        if not best_effort:
            arguments, rig = (*arguments, *RELIABLE), {'reliable': True, **rig}
        super().__init__(domain, **rig)
        self.node = NodeProcess(domain, *arguments, module=module)

    def close(self):
        """End the node, where it still runs, and what is here."""
        try:
            self.node.finish()
        finally:
            super().close()

    def check(self):
        """See that the node lives."""
        assert self.node.alive(), self.node.log()

    def heard(self):
        """Return what was heard of the node last, and its log."""
        return f'{super().heard()}\n{self.node.log()}'

    def connect(self):
        """Wait until the node is ready and has subscribed to the rig."""
        self.node.logged('ready', timeout=START)
        self.until(self.rig.subscribed, 'the node subscribes to the rig')

    def begin(self, left, right, **topics):
        """Subscribe as `listen` does, and return the DisparityImage of a first pair."""
        self.listen(**topics)
        self.connect()
        return self.first_match(left, right)

    def counts(self):
        """Return a dict of the values of diagnostics when all pairs have come to something."""
        # A disparity is heard of before the node has noted its pair.
        return self.until(
            lambda: counts if (counts := self.counts_now())['pairs waiting'] == '0' else None,
            'no pair waits')

    def counts_now(self):
        """Return a dict of the values of a diagnostics message that is newer than this call."""
        self.diagnostics.clear()
        asked = self.listener.get_clock().now().nanoseconds

        def newer():
            return next((message for message in self.diagnostics
                         if stamp_of(message.header) > asked), None)

        message = self.until(newer, 'diagnostics')
        self.status = message.status[0]
        return values_in(message)

    def set_parameters(self, **values):
        """Ask for changes all at once; return (done, reason)."""
        request = SetParametersAtomically.Request(parameters=[
            Parameter(name, value=value).to_parameter_msg() for name, value in values.items()])
        result = self._ask(SetParametersAtomically, 'set_parameters_atomically', request).result
        return result.successful, result.reason

    def change(self, **values):
        """Set parameters of the matcher and return when the next pair is matched with them."""
        mark = self.node.mark()
        done = self.set_parameters(**values)
        self.node.logged('prepared, from the next pair on', after=mark, timeout=START)
        return done

    def descriptor(self, name):
        request = DescribeParameters.Request(names=[name])
        return self._ask(DescribeParameters, 'describe_parameters', request).descriptors[0]

    def trigger(self, name):
        """Call a service of the node of type Trigger; return (done, sentence)."""
        answer = self._ask(Trigger, name, Trigger.Request(), again=SOON)
        return answer.success, answer.message
