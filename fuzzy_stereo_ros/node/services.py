# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The services of the node: `~/reset` forgets the previous frame, `~/save` saves the last pair."""
from datetime import datetime
import os
from pathlib import Path
import threading
import traceback

from fuzzy_stereo_ros.saved_pair import SavedPair, write_saved_pair
from std_srvs.srv import Trigger


class Services:
    """The services `~/reset` and `~/save`."""

    def __init__(self, node, matcher, folder, most, describe):
        """Create the services; folder: of at most `most` pairs; describe(): their texts."""
        self._node, self._matcher, self._describe = node, matcher, describe
        self._folder, self._most = Path(os.path.expanduser(folder)), most
        self._saving = False
        reset = node.create_service(Trigger, '~/reset', self._reset)
        # `_answer` replaces the method that sends the response, as an awaited callback would make
        # the executor fail if the service is destroyed meanwhile.
        save = node.create_service(Trigger, '~/save', lambda request, response: response)
        self._send, save.send_response = save.send_response, self._answer
        self._services, self._closed = (reset, save), False

    def close(self):
        """Destroy the services; a pair that is being saved is saved without an answer."""
        self._closed = True
        for service in self._services:
            self._node.destroy_service(service)

    def _reset(self, request, response):
        self._matcher.reset()
        response.success = True
        response.message = 'the next pair is matched without the previous frame'
        return response

    def _answer(self, response, header):
        """Save the last pair and send the response in a new thread: the executor stays free."""
        last, about = self._matcher.last, self._describe()
        if last is None:
            response.message = 'no pair has been matched yet; nothing is saved'
        elif self._saving:
            response.message = 'another pair is being saved; call again when it is done'
        else:
            self._saving = True
            threading.Thread(target=self._save, args=(last, about, response, header),
                             name='save').start()
            return
        self._send(response, header)

    def _save(self, last, about, response, header):
        when = datetime.now().strftime('%Y-%m-%d_%H-%M-%S.%f')
        folder = self._folder / f'{self._node.get_name()}_{when}'
        try:
            if str(folder).startswith('~'):
                raise ValueError('there is no home; set save_directory to another folder')
            self._folder.mkdir(parents=True, exist_ok=True)
            saved = sum(1 for _ in self._folder.glob('*/pair.json'))
            if saved >= self._most:
                raise ValueError(f'{self._folder} has {saved} saved pairs, and max_saved_pairs is '
                                 f'{self._most}; remove some, or start the node with more')
            write_saved_pair(folder, SavedPair(
                pair=last.pair, config=last.config, state=last.before, rows=last.rows,
                match=last.match, about=about))
            response.success = True
            response.message = (f'saved to {folder}; match it again with '
                                f'`fuzzy-stereo match --saved {folder}`')
        except (OSError, ValueError) as error:
            response.message = f'the last pair cannot be saved to {folder}: {error}'
        except Exception:      # noqa: B902  the caller waits for an answer
            response.message = ('the last pair cannot be saved, by an internal error: '
                                + traceback.format_exc().rstrip())
        self._saving = False
        if self._node.context.ok() and not self._closed:
            self._send(response, header)
