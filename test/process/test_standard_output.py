# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What `fuzzy-stereo` prints may find no reader, no room, or nowhere to go: no traceback."""
from contextlib import contextmanager
import os
from pathlib import Path
import subprocess
import sys

from fuzzy_stereo_ros.pairs.disparity_files import write_disparity
import numpy as np
import pytest
from repository import ROOT

CONVERTED = 'convert', 'a.npy', 'b.pfm'


@contextmanager
def pipe_without_reader():
    """Give the writing end of a pipe whose reading end is closed."""
    reading, writing = os.pipe()
    os.close(reading)
    yield writing
    os.close(writing)


@pytest.fixture(params=['', '1'], ids=['buffered', 'unbuffered'])
def run(request, tmp_path):
    """Return a function that runs `fuzzy-stereo` in a folder with a.npy; its stderr is a text."""
    write_disparity(tmp_path / 'a.npy', np.ones((2, 4)))

    def process(*words, variables=None, **options):
        return subprocess.run(
            [sys.executable, '-m', 'fuzzy_stereo_ros.commands.command_line', *words], cwd=tmp_path,
            stderr=subprocess.PIPE, text=True, **options, env={
                **os.environ, 'PYTHONPATH': str(ROOT), 'PYTHONUNBUFFERED': request.param,
                **(variables or {})})

    return process


@pytest.mark.parametrize('words', [CONVERTED, ('convert', '--help')])
def test_without_a_reader_it_ends_without_a_word_as_by_the_signal(run, tmp_path, words):
    with pipe_without_reader() as writing:
        ended = run(*words, stdout=writing)
    assert ended.stderr == ''
    if words == CONVERTED:
        assert ended.returncode == 141
        assert (tmp_path / 'b.pfm').exists()


def test_bad_input_stays_bad_input_without_a_reader(run):
    with pipe_without_reader() as writing:
        ended = run('convert', 'none.npy', 'b.pfm', stdout=writing)
    assert ended.returncode == 2
    assert ended.stderr.startswith('fuzzy-stereo: none.npy cannot be read')


@pytest.mark.skipif(not Path('/dev/full').exists(), reason='there is no /dev/full')
def test_a_disk_that_is_full_for_what_is_printed_is_a_failure_in_one_sentence(run):
    with open('/dev/full', 'wb') as full:
        ended = run(*CONVERTED, stdout=full)
    assert ended.returncode == 2
    assert ended.stderr in (
        'fuzzy-stereo: standard output cannot be written: No space left on device\n',
        'fuzzy-stereo: No space left on device\n')


@pytest.mark.parametrize('name', [b'\xe9t\xe9.pfm', 'éξ.pfm'.encode()])
@pytest.mark.parametrize('encoding', ['utf-8:strict', 'ascii:strict', 'latin-1'])
def test_a_name_that_the_terminal_cannot_show_is_written_and_shown_escaped(
        run, tmp_path, name, encoding):
    ended = run(b'convert', b'a.npy', name, stdout=subprocess.DEVNULL,
                variables={'PYTHONIOENCODING': encoding})
    assert (ended.returncode, ended.stderr) == (0, '')
    assert os.fsencode(tmp_path / os.fsdecode(name)) in map(os.fsencode, tmp_path.iterdir())


@pytest.mark.parametrize('closed', [(1,), (2,), (1, 2)])
def test_closed_streams_are_no_obstacle(run, tmp_path, closed):
    ended = run(*CONVERTED, preexec_fn=lambda: [os.close(stream) for stream in closed],
                stdout=subprocess.DEVNULL)
    assert (ended.returncode, ended.stderr) == (0, '')
    assert (tmp_path / 'b.pfm').exists()
