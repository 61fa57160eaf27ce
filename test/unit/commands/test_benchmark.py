# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""`fuzzy-stereo benchmark` measures each matcher in turns, and says what it cannot measure."""
import json

from fuzzy_stereo_ros.commands.benchmark import take_turns
from fuzzy_stereo_ros.commands.command_line import main

SMALL = ['--columns', '96', '--rows', '48', '--disparities', '16', '--repeats', '2']


def test_each_matcher_has_its_latency_processor_time_and_memory(capsys):
    assert main(['benchmark', *SMALL, '--threads', '1', '--json']) == 0
    report = json.loads(capsys.readouterr().out)
    (table,) = report['tables']
    assert table['title'] == '96x48, 16 disparities' and report['settings']['threads'] == '1 each'
    assert [row[0] for row in table['rows']] == [
        'ours, cold', 'ours, warm', 'OpenCV BM tuned', 'OpenCV SGBM tuned', 'OpenCV 3WAY tuned',
        'OpenCV HH4 tuned']
    for _, median, late, processor, memory in table['rows']:
        assert 0 < median <= late and processor > 0
        assert memory >= 0


def test_matchers_take_turns_and_the_first_turn_does_not_count():
    called = []

    def work(name):
        def call(frame):
            called.append((name, frame))
            return {'stage': 1.0} if name == 'a' else None
        return call

    turns = take_turns({name: work(name) for name in 'ab'}, turns=3, frames=2)
    assert called == [(name, frame) for frame in (0, 0, 1, 0) for name in 'ab']
    assert [turn['matcher'] for turn in turns] == list('ababab')
    assert all(turn['milliseconds'] > 0 and turn['processor'] >= 0 for turn in turns)
    assert ['stage' in turn for turn in turns] == [True, False] * 3
