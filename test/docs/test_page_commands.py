# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The commands of the pages work as they are written; those of make would run what they name."""
from importlib.util import find_spec
from pathlib import Path
import re
import shutil

from bench.__main__ import SUITES
import cv2
from fuzzy_stereo_ros.commands import command_line
from fuzzy_stereo_ros.commands.command_line import main
from fuzzy_stereo_ros.pairs.camera_files import (
    centred_calibration, rectified_cameras, write_camera)
from fuzzy_stereo_ros.pairs.disparity_files import write_disparity
from fuzzy_stereo_ros.pairs.image_files import write_image
from fuzzy_stereo_ros.saved_pair import write_saved_pair
from fuzzy_stereo_ros.synthetic.scenes import make_pair
from fuzzy_stereo_ros.views.video import VideoFile
from node_process import START
import numpy as np
from pages import commands, GUIDES, in_code_style, pages_with_commands, ROOT, text_of
import pytest
from saved_scene import running
import written_scenes

ALL = [(page, words) for page in pages_with_commands() for words in commands(page)]
PYTHON = re.compile('```python\n(.*?)```', re.DOTALL)


@pytest.fixture(scope='module')
def filled(tmp_path_factory):
    """Return a folder with what the pages' commands read."""
    made_bags = pytest.importorskip('made_bags', reason='rosbags is not installed')
    folder = tmp_path_factory.mktemp('read')
    pair = make_pair(48, 100, 64)
    written_scenes.write_images(folder, pair, 'left.png', 'right.png')
    write_disparity(folder / 'disparity.pfm', pair.truth)
    write_saved_pair(folder / 'report', running()[2])
    pairs = made_bags.scene(2, columns=100)
    made_bags.write_bag(folder / 'recorded', pairs=pairs)
    made_bags.write_bag(folder / 'recorded.bag', 'ros1', pairs)
    made_bags.write_bag(folder / 'images_only', pairs=pairs, infos=False)
    for side in ('left', 'right'):
        images = [getattr(one, side) for one in pairs]
        video = VideoFile(folder / f'{side}.mp4', 10.0)
        for number, image in enumerate(images):
            video.write(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR) if image.ndim == 2 else image)
            for place in (side, f'{side}_folder'):
                (folder / place).mkdir(exist_ok=True)
                write_image(folder / place / f'{number}.png', image)
        video.close()
    calibration = centred_calibration(63.0, 0.12, 0.0, 48, 100)
    for side, camera in rectified_cameras(calibration, 48, 100).items():
        write_camera(folder / f'{side}.yaml', camera, side)
    raw = cv2.FileStorage(str(folder / 'stereo.yml'), cv2.FILE_STORAGE_WRITE)
    camera = np.array([[63.0, 0, 49.5], [0, 63, 23.5], [0, 0, 1]])
    for name, value in (('K1', camera), ('K2', camera), ('D1', np.zeros(5)), ('D2', np.zeros(5)),
                        ('R', np.eye(3)), ('T', np.array([-0.12, 0, 0]))):
        raw.write(name, value)
    raw.release()
    scene = written_scenes.pair()
    written_scenes.write_named(folder / 'datasets' / 'scene', scene)
    (folder / 'results').mkdir()
    write_disparity(folder / 'results' / 'scene.pfm', scene.truth)
    return folder


@pytest.fixture
def here(filled, tmp_path, monkeypatch):
    """Work in a folder of its own with what the pages' commands read."""
    monkeypatch.chdir(shutil.copytree(filled, tmp_path / 'here'))


def work(words):
    """Run a command and see that what it writes is there; a page may name a file twice."""
    again = ['--overwrite'] * (words[1] in ('convert', 'match') and '--overwrite' not in words)
    assert main([*words[1:], *again]) == 0, words
    for option, name in zip(words, words[1:]):
        if option in ('--output', '--picture', '--video', '--html', '--csv'):
            place = Path(name)
            assert place.is_dir() or place.stat().st_size > 1000 or place.suffix == '.csv', words


@pytest.mark.parametrize('name, workers', [
    *(pytest.param(name, False, marks=[pytest.mark.slow] * (
        name in ('benchmark', 'evaluate', 'evolve')))
      for name in sorted({words[1] for page, words in ALL if page in GUIDES
                          and words[0] == 'fuzzy-stereo'})),
    pytest.param('replay', True, marks=[pytest.mark.slow])])
def test_the_examples_of_a_command_work_as_they_are_written(name, workers, here):
    if workers:
        pytest.importorskip('distributed', reason='the extra cluster is not installed')
    short = {'synthesise': ['--columns', '70', '--rows', '20', '--frames', '1'],
             'benchmark': ['--columns', '96', '--rows', '48', '--repeats', '1'],
             'evolve': ['--generations', '2']}.get(name, [])
    for page in GUIDES:
        for words in commands(page, f'fuzzy-stereo {name}'):
            if workers == ('--workers' in words) and not (
                    page == 'README.md' and name == 'replay'):      # the same as in docs/bags.md
                work([*words, *short])


@pytest.mark.slow
@pytest.mark.parametrize('page', [page for page in pages_with_commands()
                                  if page not in GUIDES and commands(page, 'fuzzy-stereo')])
def test_the_commands_of_a_page_work_in_their_order(page, here):
    for words in commands(page, 'fuzzy-stereo'):
        work(words)


def test_every_command_and_every_suite_of_benchmarks_is_shown_and_there_is_no_other():
    assert {words[1] for _, words in ALL if words[0] == 'fuzzy-stereo'} == set(
        command_line.commands())
    assert {words[3] for _, words in ALL if words[:3] == ['python', '-m', 'bench']} == set(SUITES)


def test_the_commands_inside_sentences_and_those_of_make_are_commands():
    make = [(page, words) for page, words in ALL if words[0] == 'make']
    inside = [(page, code.split()) for page in pages_with_commands()
              for code in in_code_style(page)]
    for page, words in make + inside:
        if words[:1] == ['fuzzy-stereo'] and len(words) > 1:
            assert words[1] in command_line.commands(), f'{page}: {words}'
        elif words[:2] == ['python', '-m']:
            assert find_spec(words[2]), f'{page}: {words}'
        elif words[:1] == ['make'] and (len(words) == 2 or (page, words) in make):
            assert re.search(f'^{words[1]}:', text_of('Makefile'), re.MULTILINE), page


def test_the_python_of_the_readme_matches():
    pair = make_pair(48, 100, 64)
    found = PYTHON.findall(text_of('README.md'))
    (example,) = (block for block in found if block.startswith('from fuzzy_stereo_ros'))
    names = {'left': pair.left, 'right': pair.right}
    exec(compile(example, 'README.md', 'exec'), names)
    assert names['match'].disparity.shape == pair.truth.shape


@pytest.mark.parametrize('number', range(len(PYTHON.findall(text_of('docs/extend.md')))))
def test_an_example_of_extending_runs_as_it_stands(number, capsys):
    example = PYTHON.findall(text_of('docs/extend.md'))[number]
    exec(compile(example, 'docs/extend.md', 'exec'), {'__name__': 'example'})
    assert capsys.readouterr().out


@pytest.mark.slow       # a kernel of Jupyter starts
def test_the_notebook_runs_and_is_kept_without_outputs():
    nbclient = pytest.importorskip('nbclient', reason='nbclient is not installed')
    nbformat = pytest.importorskip('nbformat', reason='nbformat is not installed')
    pytest.importorskip('ipykernel', reason='ipykernel is not installed')
    notebook = nbformat.read(ROOT / 'docs' / 'first_match.ipynb', as_version=4)
    assert not any(cell.get('outputs') for cell in notebook.cells)
    nbclient.NotebookClient(notebook, timeout=START, kernel_name='python3',
                            resources={'metadata': {'path': str(ROOT)}}).execute()
