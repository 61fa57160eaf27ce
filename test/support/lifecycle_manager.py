# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What Nav2's lifecycle manager asks of a node: its state, and a change, by two services."""
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from node_process import START


class Manager:
    """Asks `/disparity_node` through the listener of `ros_bench.Surroundings`."""

    def __init__(self, around):
        """Wait for both services."""
        self._around = around
        self._clients = {
            kind: around.listener.create_client(kind, f'/disparity_node/{name}')
            for kind, name in ((ChangeState, 'change_state'), (GetState, 'get_state'))}
        for client in self._clients.values():
            around.until(client.service_is_ready, client.srv_name, timeout=START)

    def state(self):
        answer = self._around.answer(self._clients[GetState], GetState.Request(), START)
        return answer.current_state.label

    def change(self, name):
        """Ask for a transition, wait for its end, and return the label of the state then."""
        before = self.state()
        number = getattr(Transition, f'TRANSITION_{name.upper()}')
        future = self._clients[ChangeState].call_async(
            ChangeState.Request(transition=Transition(id=number)))
        self._around.until(future.done, f'the end of {name}', timeout=START)
        state = self.state()
        assert future.result().success == (state != before), name
        return state

    def asked(self, **transition):
        """Ask for a transition by its id or label; return whether it succeeded."""
        request = ChangeState.Request(transition=Transition(**transition))
        return self._around.answer(self._clients[ChangeState], request, START).success
