# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Open a page in headless Chromium, by its protocol of development tools over two pipes."""
from contextlib import contextmanager
import json
import os
import shutil
import subprocess
import sys

CHROMIUM = next(filter(None, map(shutil.which, (
    'chromium', 'chromium-browser', 'google-chrome', 'google-chrome-stable'))), None)
# Chromium reads commands from file 3 and answers to file 4.
START = """import fcntl, os, sys
ends = [fcntl.fcntl(int(number), fcntl.F_DUPFD, 10) for number in sys.argv[1:3]]
os.dup2(ends[0], 3)
os.dup2(ends[1], 4)
os.execv(sys.argv[3], sys.argv[3:])"""
KEYS = {'ArrowRight': 39, 'ArrowLeft': 37, 'Tab': 9}


class Tab:
    """A page in a tab."""

    def __init__(self, commands, answers):
        """Open a tab; commands, answers: files of bytes, to Chromium and from it."""
        self._commands, self._answers, self._number, self._session = commands, answers, 0, {}
        target = self._ask('Target.createTarget', url='about:blank')['targetId']
        self._session = {'sessionId': self._ask(
            'Target.attachToTarget', targetId=target, flatten=True)['sessionId']}

    def show(self, path, width):
        """Load a file into a window of a width, px, and wait for it."""
        self._ask('Emulation.setDeviceMetricsOverride', width=width, height=900,
                  deviceScaleFactor=1, mobile=False)
        self._ask('Page.navigate', url=path.resolve().as_uri())
        while self.value('document.readyState + document.URL') != (
                f'complete{path.resolve().as_uri()}'):
            pass

    def value(self, code):
        """Return the value of JavaScript, for which it waits if it is a promise."""
        found = self._ask('Runtime.evaluate', expression=code, returnByValue=True,
                          awaitPromise=True)
        assert 'exceptionDetails' not in found, found
        return found['result'].get('value')

    def press(self, key):
        """Press and release one of KEYS."""
        for kind in ('rawKeyDown', 'keyUp'):
            self._ask('Input.dispatchKeyEvent', type=kind, key=key, code=key,
                      windowsVirtualKeyCode=KEYS[key])

    def _ask(self, method, **parameters):
        """Return the result of a command."""
        self._number += 1
        self._commands.write(json.dumps({'id': self._number, 'method': method,
                                         'params': parameters, **self._session}).encode() + b'\0')
        self._commands.flush()
        while True:
            answer = b''
            while not answer.endswith(b'\0'):
                byte = self._answers.read(1)
                assert byte, 'Chromium has ended'
                answer += byte
            answer = json.loads(answer[:-1])
            if answer.get('id') == self._number:
                assert 'error' not in answer, answer
                return answer['result']


@contextmanager
def opened_tab(folder):
    """Yield a Tab of a Chromium that keeps its files in a folder."""
    reads, commands = os.pipe()
    answers, writes = os.pipe()
    process = subprocess.Popen(
        [sys.executable, '-c', START, str(reads), str(writes), CHROMIUM, '--headless',
         '--no-sandbox', '--disable-gpu', '--remote-debugging-pipe', f'--user-data-dir={folder}'],
        pass_fds=(reads, writes), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    os.close(reads)
    os.close(writes)
    try:
        with open(commands, 'wb') as to, open(answers, 'rb', buffering=0) as back:
            yield Tab(to, back)
    finally:
        process.kill()
        process.wait()
