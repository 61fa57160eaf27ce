# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The demo runs the real node, counts every pair, and ends with a code that is true."""
import os
import re
import signal
import subprocess
import sys

from bench.demo.phase import COLUMNS, MotorcycleWindow, Phase, ROWS, table
from fuzzy_stereo_ros.pairs.image_files import read_image
import numpy as np
import pytest
from repository import ROOT

# The first start on a machine compiles, and where it is busy that takes a while.
pytestmark = pytest.mark.timeout(700)
QUICK = ('--frames', '4', '--rate', '5')


@pytest.fixture(scope='module')
def sequence():
    return MotorcycleWindow()


def start_demo(folder, *arguments, before=''):
    """Start the demo as a process in a folder, after some lines of Python of our own."""
    pytest.importorskip('rclpy', reason='rclpy is not importable: no ROS 2 here')
    script = '\n'.join(('import sys', 'from bench.demo import __main__ as demo, phase',
                        before, 'sys.exit(demo.main())'))
    return subprocess.Popen(
        [sys.executable, '-c', script, *arguments], cwd=folder, text=True,
        env={**os.environ, 'PYTHONPATH': str(ROOT)},
        stdout=subprocess.PIPE, stderr=subprocess.PIPE)


def run_demo(*arguments, **options):
    """Return exit code, what was printed, and what was printed as an error."""
    process = start_demo(*arguments, **options)
    out, err = process.communicate()
    return process.returncode, out, err


def rows_of(printed):
    """Return {row: (figure, ...)} of the table that was printed."""
    cells = [[cell.strip() for cell in line.strip('|').split('|')]
             for line in printed.splitlines() if line.startswith('|')]
    return {row[0]: tuple(row[1:]) for row in cells}


def test_the_demo_prints_the_table_of_the_real_node_and_writes_the_picture(tmp_path):
    code, out, err = run_demo(tmp_path, *QUICK, '--picture', 'seen.png')
    assert code == 0, err
    rows = rows_of(out)
    assert rows[''] == ('warm', 'cold')
    assert rows['pairs published'] == ('4', '4')
    assert rows['pairs lost'] == ('0', '0')
    for column in (0, 1):
        received, dropped = (int(rows[name][column]) for name in (
            'disparity images received', 'pairs dropped and counted by the node'))
        assert received + dropped == 4 and received > 0
        assert float(rows['density [%]'][column]) > 80
        assert float(rows['bad-1, of the published disparities [%]'][column]) < 8
        assert float(rows['latency, median [ms]'][column]) > 1
    assert re.search(f'^picture: {tmp_path}/seen.png$', out, re.MULTILINE)
    assert read_image(tmp_path / 'seen.png').shape[1] > 1000
    assert os.listdir(tmp_path) == ['seen.png']


@pytest.mark.parametrize('number, expected', [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_ends_the_demo_and_its_node_without_a_traceback(tmp_path, number, expected):
    process = start_demo(tmp_path, before="""
play = demo._play
def tell_and_play(listener, *rest):
    print('node', listener.process.pid, flush=True)
    return play(listener, *rest)
demo._play = tell_and_play""")
    (node,) = (int(line.split()[1]) for line in iter(process.stdout.readline, '')
               if line.startswith('node') and not process.send_signal(number))
    _, err = process.communicate()
    assert (process.returncode, 'Traceback' in err) == (expected, False)
    with pytest.raises(ProcessLookupError):
        os.kill(node, 0)


def test_the_window_shows_both_images_and_the_truth_of_one_place(sequence):
    for number in (0, 7, 60):
        shown = sequence.frame(number)
        assert shown.left.shape == shown.right.shape == (ROWS, COLUMNS, 3)
        rows, columns = np.nonzero(np.isfinite(shown.truth))
        matching = np.rint(columns - shown.truth[rows, columns]).astype(int)
        inside = matching >= 0
        difference = abs(shown.left[rows, columns].astype(int)[inside]
                         - shown.right[rows, matching][inside])
        assert np.median(difference) < 8


class Flat:
    """A sequence whose truth is 10 everywhere and whose window moves 2 columns a frame."""

    def frame(self, number):
        class Shown:
            truth = np.full((4, 20), 10.0)
            first_row, first_column = 0, 2 * number
        return Shown


def test_the_table_has_the_figures_that_a_person_would_count():
    first, second = np.full((4, 20), 10.0), np.full((4, 20), 10.0)
    first[:, 10:] = 13
    second[:, 8:] = 13
    second[0] = np.nan
    phase = Phase('warm', published=5, dropped=2, seconds=0.5, latencies=[20.0, 40.0])
    phase.add_scores([(0, first), (1, second)], Flat())
    rows = rows_of(table([phase, Phase('cold')]))
    assert rows['pairs lost'] == ('1', '0')
    assert rows['latency, median [ms]'] == ('30.0', '-')
    assert rows['rate [pairs/s]'] == ('4.00', '0.00')
    assert rows['density [%]'] == ('87.50', '-')
    assert rows['bad-2, of the published disparities [%]'] == ('55.00', '-')
    assert rows['bad-2 or invalid, of all pixels [%]'] == ('60.00', '-')
    assert rows['flicker: pixels that change by more than 1 px [%]'] == ('0.00', '-')
