# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The node and a camera in a soak: what can happen, what is sent, and what comes of it."""
from contextlib import contextmanager
import json
import signal
import time

from bench.soak.events import CHANGES, LARGEST, OUTPUTS, TOPICS
from bench.soak.promises import Sample, Threads, whole_numbers
from bench.soak.soaked_node import SAID
from fuzzy_stereo_ros.node.simulated_cameras import SimulatedCameras
from fuzzy_stereo_ros.pairs.messages import stamp_of
from made_scenes import shifted_pair
from node_process import NodeProcess, SOON
import psutil
from ros_bench import BASELINE, Bench, FOCAL
from sensor_msgs.msg import Image, PointCloud2
from stereo_msgs.msg import DisparityImage

DEPTH = 1000        # messages; more than a flood, so that the middleware loses none
PROBES = 12         # pairs of a sample
SHIFTS = range(2, 8)        # px, what the pairs of one size are shifted by
QUEUE_SIZE = 5
PATIENCE = 5.0      # s for an answer that may have been lost, and for a thread to end
TYPES = {'disparity': DisparityImage, 'points2': PointCloud2}    # of what is no Image


def node_arguments(disparities, folder):
    """Return the arguments of a node that is soaked, with queues for floods."""
    depths = {f'qos_overrides./{topic}.subscription.depth': DEPTH for topic in TOPICS}
    values = {
        'disparity_range': disparities, 'save_directory': folder, 'no_pair_seconds': 0.5,
        'max_saved_pairs': 1_000_000,
        'queue_size': QUEUE_SIZE, **depths}
    return ['--ros-args', *(word for name, value in values.items()
                            for word in ('-p', f'{name}:={value}'))]


class Stage(Bench):
    """
    The node, a camera that counts what it sends, and a listener; a method for each kind of event.

    sent: {topic: messages sent while the node was subscribed}. answers: set of stamps.
    threads: Threads.
    """

    def __init__(self, domain, folder, rows, columns, disparities, rate):
        """Start the node; rate: pairs/s of a stream."""
        super().__init__(domain, *node_arguments(disparities, folder), depth=DEPTH,
                         module='bench.soak.soaked_node')
        self._size, self._shape, self._rate = (rows, columns), (rows, columns), rate
        self._domain, self._made, self._number = domain, {}, 0
        self._usual = {name: None for change in CHANGES for name in change}
        self._usual['confidence_threshold'] = None
        self._jump, self._listening = 0, None
        self.sent, self.answers = dict.fromkeys(TOPICS, 0), set()
        self.threads = Threads(self.node.identity)

    def begin(self):
        """
        Wait until the node is ready and has found the camera, and have it take what it keeps.

        The middleware keeps memory for the largest message of each output, numba the kernels of
        each kind of matcher, and OpenCV its threads.
        """
        self.listen_anew()
        self.connect()
        self._usual = dict(zip(self._usual, self.parameters(*self._usual)))
        self._usual.pop('profile')
        self._shape = self.shape_of(LARGEST)
        every = {name: value for change in CHANGES for name, value in change.items()}
        for profile in ('quality', 'realtime'):
            for values in (every, self._usual):     # as speckles of size 0 need no kernel
                self._change(**{**values, 'profile': profile})
                self.hear('disparity')
            for topic in OUTPUTS:
                self.hear(topic)

    def sample(self):
        """Return a Sample of the node as it was started, without what events have changed."""
        self._shape, self._jump = self._size, 0
        self.leave()        # with a subscription goes what the middleware keeps of floods
        self.arrive()
        self._change(confidence_threshold=0.5)      # so that the next one changes something:
        self._change(profile='realtime', **self._usual)     # the matcher is made anew
        # Nothing is sent but probes, one at a time: the middleware keeps what waited at once.
        process = psutil.Process(self.node.identity)
        before = sum(process.cpu_times()[:2])
        for _ in range(PROBES):
            self._probe()
        work = 1000 * (sum(process.cpu_times()[:2]) - before) / PROBES
        self.answers.clear()
        memory, held = process.memory_info(), self._held()
        resident = (memory.rss - memory.shared) / 1e6
        deadline = time.monotonic() + PATIENCE
        while self.threads.left_over(held['threads']) and time.monotonic() < deadline:
            self.settle()
            held = self._held()
        return Sample(held['megabytes'], held['objects'], resident, work)

    def settle(self):
        """Return the counts of diagnostics when all that was sent has come to something."""
        deadline = time.monotonic() + SOON
        while True:
            counts = whole_numbers(self.counts_now())
            under_way = any(counts[f'received {topic}'] + counts[f'lost {topic}'] < messages
                            for topic, messages in self.sent.items())
            if time.monotonic() > deadline or not (under_way or counts['pairs waiting']):
                return {**counts, 'queue_size': QUEUE_SIZE}

    def leave_all(self):
        """Take back the subscription and return the counts when the node has done so, too."""
        self.leave()
        return self.settle()

    def leave(self):
        """Take back the subscription, when all that was sent has come to something."""
        self.settle()
        self.listener.destroy_subscription(self._listening)
        self.until(lambda: not any(map(self.listener.count_subscribers, TOPICS)),
                   'the node subscribes to nothing')

    def arrive(self):
        """Subscribe again and wait for the node to do so."""
        self.listen_anew()
        self.until(self.rig.subscribed, 'the node subscribes again')

    def hear(self, topic):
        """Subscribe to one more output until something comes."""
        heard = []
        with self._subscribed(TYPES.get(topic, Image), topic, heard.append):
            self.stream_until(lambda: heard, f'something on {topic}')

    def stream(self, pairs, change=None):
        """Send pairs at the rate."""
        for _ in range(pairs):
            due = time.monotonic() + 1 / self._rate
            self.send(change=change)
            self.until(lambda: time.monotonic() >= due, 'time passes')      # noqa: B023

    def stream_until(self, condition, what):
        """Stream until a condition is true."""
        deadline = time.monotonic() + SOON
        while not condition():
            assert time.monotonic() < deadline, f'never: {what}\n{self.heard()}'
            self.stream(1)

    def listen_anew(self):
        """Subscribe to disparities; `leave` takes it back."""
        self._listening = self.listener.create_subscription(
            DisparityImage, 'disparity',
            lambda message: self.answers.add(stamp_of(message.header)), 10)

    def count_anew(self):
        """Take as sent what has arrived or is known to be lost, when no more of it comes."""
        counts, previous = self.settle(), None
        while counts != previous:
            counts, previous = self.settle(), counts
        self.sent = {topic: counts[f'received {topic}'] + counts[f'lost {topic}']
                     for topic in TOPICS}

    def send(self, pair=None, stamp=None, change=None):
        """Send a pair, count its messages, and return its stamp in ns."""
        def count(messages):
            if change is not None:
                change(messages)
            for topic in messages:
                self.sent[topic] += 1

        if stamp is None:
            stamp = self.rig.get_clock().now().nanoseconds + self._jump
        return self.rig.publish(*(pair or self.next_pair()), stamp, count)

    def next_pair(self):
        """Return two uint8 images (R, C) of the size there is now, another one each time."""
        self._number += 1
        pairs = self.pairs_of(self._shape)
        return pairs[self._number % len(pairs)]

    def pairs_of(self, shape):
        """Return all pairs of a shape (R, C)."""
        if shape not in self._made:
            self._made[shape] = [shifted_pair(shift, *shape) for shift in SHIFTS]
        return self._made[shape]

    def shape_of(self, share):
        """Return (R, C) of shares of the rows and columns at the start."""
        return tuple(round(side * part) for side, part in zip(self._size, share))

    def _change(self, **values):
        done, reason = self.set_parameters(**values)
        assert done, reason
        self.until(lambda: not self.counts_now()['change of parameters'].startswith('being'),
                   'parameters are prepared')

    def _held(self):
        """Return what the node says it holds, as of `soaked_node.held`."""
        mark = self.node.mark()
        self.node.send(signal.SIGUSR1)
        return json.loads(self.node.logged(SAID, after=mark).partition(SAID)[2])

    @contextmanager
    def _subscribed(self, kind, topic, take):
        subscription = self.listener.create_subscription(kind, topic, take, 10)
        try:
            yield
        finally:
            self.listener.destroy_subscription(subscription)

    def _probe(self):
        """Send a pair and wait for its disparity."""
        def answer():       # one that the node loses shows in the sums
            return stamp in self.answers or time.monotonic() > begun + PATIENCE

        stamp = None
        while stamp not in self.answers:
            begun = time.monotonic()
            stamp = self.send()
            self.until(answer, f'disparity of {stamp}')

    # ---- what can happen ----

    def happen(self, event, seconds):
        """Have an Event happen, and a stream of pairs for a time after it."""
        getattr(self, event.kind)(**event.values)
        self.threads.note(event.kind)
        self.stream(round(self._rate * seconds))

    def flood(self, pairs):
        """Send pairs as fast as it goes."""
        for _ in range(pairs):
            self.send()

    def camera_dies(self, pairs):
        """End the camera in the middle of its work and start it again."""
        self.flood(pairs)
        self.settle()
        self.executor.remove_node(self.rig)
        self.rig.destroy_node()
        self.rig = SimulatedCameras(
            f'rig_{self._domain}', FOCAL, BASELINE, reliable=True, depth=DEPTH,
            context=self.context)
        self.executor.add_node(self.rig)
        self.until(self.rig.subscribed, 'the node finds the camera again')

    def camera_is_killed(self):
        """Have another camera publish from a process of its own that ends without a word."""
        before = self.settle()
        camera = NodeProcess(
            self._domain, '--columns', str(self._size[1]), '--rows', str(self._size[0]),
            '--frames', '4', '--rate', str(self._rate), '--reliable',
            module='fuzzy_stereo_ros.node.simulated_cameras')
        try:
            enough = before['pairs matched'] + 4
            self.until(lambda: int(self.counts_now()['pairs matched']) >= enough,
                       'disparities of another camera')
        finally:
            camera.finish(9)
        self.count_anew()

    def stamps_jump(self, seconds):
        """Have all stamps from now on differ from the clock."""
        self._jump = round(seconds * 1e9)

    def stamps_repeat(self, pairs):
        """Send several pairs of one stamp."""
        stamp = self.rig.get_clock().now().nanoseconds
        for _ in range(pairs):
            self.send(stamp=stamp)

    def size_changes(self, share):
        """Have images of another size from now on."""
        self._shape = self.shape_of(share)

    def sides_differ(self, share, pairs):
        """Send pairs whose right images have another size."""
        other = self.pairs_of(self.shape_of(share))[0][1]
        for _ in range(pairs):
            self.send((self.next_pair()[0], other))

    def damage(self, how, pairs):
        """Send pairs that cannot be matched."""
        def harm(messages):
            if how == 'encoding':
                messages['left/image_rect'].encoding = 'none'
            elif how == 'data':
                messages['right/image_rect'].data = messages['right/image_rect'].data[:9]
            else:
                messages['right/camera_info'].p[3] = 0.0

        self.stream(pairs, harm)

    def topic_is_missing(self, topic, pairs):
        """Send pairs without one of their four messages."""
        self.stream(pairs, lambda messages: messages.pop(topic))

    def silence(self):
        """Send nothing until the node asks for it."""
        mark = self.node.mark()
        self.send()     # what was said of a silence before does not count
        self.until(lambda: 'no stereo pair for' in self.node.log(mark), 'a word on the silence')

    def parameters_change(self, changes):
        """Change parameters several times, faster than it can be prepared."""
        for values in changes:
            done, reason = self.set_parameters(**values)
            assert done, reason

    def parameters_are_rejected(self, values):
        """Ask for a change that is not allowed."""
        done, reason = self.set_parameters(**values)
        assert not done and reason, f'{values} were not rejected'

    def subscriber_comes_and_goes(self, topic):
        """Subscribe to one more output for a while."""
        self.hear(topic)

    def all_subscribers_go(self, pairs):
        """Listen to nothing, send to nobody, and listen again."""
        self.leave_all()
        for _ in range(pairs):
            self.rig.publish(*self.next_pair())
        self.arrive()

    def reset(self):
        """Have the node forget what was before."""
        assert self.trigger('reset')[0]

    def save(self):
        """Have the node save the last pair, once there is one."""
        self.stream_until(lambda: self.answers, 'a disparity')
        done, sentence = self.trigger('save')
        assert done, sentence
