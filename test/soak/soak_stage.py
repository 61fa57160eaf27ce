# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What can happen in a soak: each kind of event as a method that returns when it is over."""
from fuzzy_stereo_ros.synthetic.simulated_cameras import SimulatedCameras
from node_process import NodeProcess
from ros_bench import BASELINE, FOCAL
from soak_bench import DEPTH, SoakBench
from soak_script import TOPICS


class SoakStage(SoakBench):
    """Has Events happen: a method for each kind."""

    def happen(self, event, seconds):
        """Have an Event happen, and a stream of pairs for a time after it."""
        self.waits.event = event.kind
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
            f'rig_{self._domain}', FOCAL, BASELINE, reliable=not self._best_effort, depth=DEPTH,
            context=self.context)
        self.executor.add_node(self.rig)
        self.until(self.rig.subscribed, 'the node finds the camera again')
        self.meet()

    def camera_is_killed(self):
        """Have another camera publish from a process of its own that ends without a word."""
        before = self.settle()
        camera = NodeProcess(
            self._domain, '--columns', str(self._size[1]), '--rows', str(self._size[0]),
            '--frames', '4', '--rate', str(self._rate),
            *([] if self._best_effort else ['--reliable']),
            module='fuzzy_stereo_ros.synthetic.simulated_cameras')
        try:
            enough = before['pairs matched'] + 4
            self.until(lambda: int(self.counts_now()['pairs matched']) >= enough,
                       'disparities of another camera')
        finally:
            camera.finish(9)
        if self._best_effort:   # while there seem to be two cameras, gaps cannot be told
            self.until(lambda: self.listener.count_publishers(TOPICS[0]) == 1,
                       'the other camera is forgotten')
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

    def parameters_are_refused(self, values):
        """Ask for a change that is not allowed."""
        done, reason = self.set_parameters(**values)
        assert not done and reason, f'{values} were not refused'

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
