# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the node does when it is asked: forget what was before, and save the last pair."""
from datetime import datetime
import os
from pathlib import Path
import threading

from fuzzy_stereo_ros.reports import trace
from fuzzy_stereo_ros.saved_pairs.saved_pair import SavedPair, write_saved_pair
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.task import Future
from std_srvs.srv import Trigger


class Services:
    """The services `~/reset` and `~/save`."""

    def __init__(self, node, rig, folder, about):
        """
        Offer the services.

        rig: the Rig whose pairs they are about. folder: where `~/save` makes folders.
        about(): returns {key: text}, what else is worth to be saved.
        """
        self._node, self._rig, self._about = node, rig, about
        self._folder = Path(os.path.expanduser(folder))
        node.create_service(Trigger, '~/reset', self._reset)
        # In a group of its own: while it waits for the files, all else has its turns.
        node.create_service(
            Trigger, '~/save', self._save, callback_group=ReentrantCallbackGroup())

    def _reset(self, request, response):
        self._rig.forget()
        response.success, response.message = True, 'the next pair is matched from nothing'
        return response

    async def _save(self, request, response):
        """Write in a thread of its own: the executor stays free."""
        last, about = self._rig.last, self._about()
        if last is None:
            response.message = 'no pair has been matched yet; nothing is saved'
            return response
        written = Future(executor=self._node.executor)
        written.add_done_callback(lambda _: None)   # without one the executor is not woken
        threading.Thread(
            target=lambda: written.set_result(self._write(last, about)), name='save').start()
        response.success, response.message = await written
        return response

    def _write(self, last, about):
        """Write a folder and return (done, sentence)."""
        if str(self._folder).startswith('~'):
            return False, (f'the last pair cannot be saved to {self._folder}: there is no home; '
                           'set save_directory to another folder')
        when = datetime.now().strftime('%Y-%m-%d_%H-%M-%S.%f')
        folder = self._folder / f'{self._node.get_name()}_{when}'
        try:
            folder.parent.mkdir(parents=True, exist_ok=True)
            write_saved_pair(folder, SavedPair(
                pair=last.pair, config=last.config, state=last.before, match=last.match,
                about=about))
        except (OSError, ValueError) as error:
            return False, f'the last pair cannot be saved to {folder}: {error}'
        except Exception as error:      # noqa: B902  whatever it is, the caller waits
            return False, f'the last pair cannot be saved, a fault of this package: {trace(error)}'
        return True, (f'saved to {folder}; match it again with '
                      f'`fuzzy-stereo match --saved {folder}`')
