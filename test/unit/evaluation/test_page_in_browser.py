# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The page of an evaluation in headless Chromium, by its protocol of tools: wide and narrow."""
from contextlib import contextmanager
import json
import os
import shutil
import subprocess
import sys

from fuzzy_stereo_ros.commands.command_line import main
from fuzzy_stereo_ros.pairs.image_files import write_image
from fuzzy_stereo_ros.synthetic.scenes import make_pair
import pytest

pytest.importorskip('jinja2', reason='the extra evaluate is not installed')
CHROMIUM = next(filter(None, map(shutil.which, (
    'chromium', 'chromium-browser', 'google-chrome', 'google-chrome-stable'))), None)
# Chromium reads commands from file 3 and answers to file 4.
START = """import fcntl, os, sys
ends = [fcntl.fcntl(int(number), fcntl.F_DUPFD, 10) for number in sys.argv[1:3]]
os.dup2(ends[0], 3)
os.dup2(ends[1], 4)
os.execv(sys.argv[3], sys.argv[3:])"""
KEYS = {'ArrowRight': 39, 'ArrowLeft': 37, 'Tab': 9}
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason='Chromium is not installed')

WIDER = """[...document.querySelectorAll('body, body *')].filter(
    each => each.getBoundingClientRect().right > innerWidth + 0.5
            || each.scrollWidth > each.clientWidth + 1 && each.clientWidth > 0
               && getComputedStyle(each).overflowX != 'visible').map(each => each.outerHTML)"""
BROKEN = """Promise.all([...document.images].map(each => each.decode().then(
    () => each.naturalWidth > 0, () => false))).then(all => all.filter(one => !one).length)"""
SHOWN = """[...document.querySelectorAll('.pair')].filter(
    each => each.offsetHeight > 0).map(each => each.id)"""


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


@pytest.fixture(scope='module')
def pages(tmp_path_factory):
    """Return {what was evaluated: the path of its page}, each of three pairs."""
    place = tmp_path_factory.mktemp('pages')
    made = str(place / 'made')
    assert main(['synthesise', '--output', made, '--rows', '90', '--columns', '200',
                 '--disparities', '24', '--frames', '3']) == 0
    for number, name in enumerate(('one', 'two', 'a_name_of_a_scene_that_is_very_long_' * 3)):
        pair = make_pair(60 + number, 420, 24)
        (place / 'scenes' / name).mkdir(parents=True)
        for side in ('left', 'right'):
            write_image(place / 'scenes' / name / f'{side}.png', getattr(pair, side))
    pages = {}
    for what, words in {'with truth': [made],
                        'scenes without truth': [str(place / 'scenes')]}.items():
        pages[what] = place / f'{what}.html'
        assert main(['evaluate', *words, '--repeats', '1', '--html', str(pages[what])]) == 0
    return pages


@pytest.fixture(scope='module')
def tab(tmp_path_factory):
    with opened_tab(tmp_path_factory.mktemp('chromium')) as tab:
        yield tab


@pytest.mark.parametrize('what', ['with truth', 'scenes without truth'])
@pytest.mark.parametrize('width', [1600, 1280, 1000, 999, 600, 390, 320])
def test_every_pair_fits_the_page_and_is_chosen_by_keyboard(pages, tab, what, width):
    tab.show(pages[what], width)
    assert tab.value(BROKEN) == 0 and tab.value('document.images.length') >= 3 * 6
    tab.press('Tab')
    for place in (1, 2, 3):
        assert tab.value(SHOWN) == [f'pair-{place}']
        assert tab.value(WIDER) == []
        tab.press('ArrowRight')
    tab.press('ArrowLeft')
    assert tab.value(SHOWN) == ['pair-3']
    for word, place in (('previous', 2), ('next', 3)):
        tab.value(f"[...document.querySelectorAll('.step label')].find(each => each.offsetHeight "
                  f"&& each.textContent.includes('{word}')).click()")
        assert tab.value(SHOWN) == [f'pair-{place}']
