# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Where commands and the node write, and that they open no sockets: SECURITY.md promises it."""
from audits import all_files, environment, noted
from fuzzy_stereo_ros.commands.command_line import main
from fuzzy_stereo_ros.saved_pair import write_saved_pair
from fuzzy_stereo_ros.synthetic.scenes import make_pair
import pytest
from repository import COMMAND_LINE, printed_by
from saved_scene import running
from written_scenes import write_images


def audited(folder, *words):
    """Run `fuzzy-stereo` with words in a folder's `work` and return what it did elsewhere."""
    printed_by('-m', 'audited', *words, folder=folder / 'work',
               **environment(folder, COMMAND_LINE))
    return noted(folder, [folder / 'work' / 'out'])


@pytest.fixture
def folder(tmp_path):
    """Return a folder with a home, and a place to work with images, a saved pair and `out`."""
    for name in ('home', 'work', 'work/out'):
        (tmp_path / name).mkdir()
    write_images(tmp_path / 'work', make_pair(40, 100, 32), 'left.png', 'right.png')
    write_saved_pair(tmp_path / 'work' / 'report', running()[2])
    return tmp_path


COMMANDS = {
    'match': 'match left.png right.png --disparities 32 --output out/disparity.pfm --picture '
             'out/disparity.png',
    'saved': 'match --saved report --output out/again.npy',
    'synthesise': 'synthesise --output out/scene --frames 1 --columns 70 --rows 20',
    'synthesise a bag': 'synthesise --output out/bag --format bag --frames 2 --columns 70 '
                        '--rows 20',
    'replay a bag': 'replay recorded --output out/matched --disparities 16 --files npy --keep',
}


@pytest.mark.parametrize('name', COMMANDS)
def test_a_command_writes_only_where_it_is_told_and_opens_no_socket(name, folder):
    if 'bag' in name:
        made_bags = pytest.importorskip('made_bags', reason='rosbags is not installed')
        made_bags.write_bag(folder / 'work' / 'recorded', pairs=made_bags.scene(2))
    assert audited(folder, *COMMANDS[name].split()) == []
    assert [*(folder / 'work' / 'out').iterdir()]
    assert [*(folder / 'home').iterdir()] == []


def test_names_of_topics_in_a_bag_are_no_paths(tmp_path):
    made_bags = pytest.importorskip('made_bags', reason='rosbags is not installed')
    inner = tmp_path / 'one' / 'two' / 'three'
    inner.mkdir(parents=True)
    made_bags.write_bag(inner / 'recorded', pairs=made_bags.scene(2), topics=[
        f'/../../../evil{topic}' for topic in made_bags.TOPICS])
    before = all_files(tmp_path)
    assert main(['replay', str(inner / 'recorded'), '--output', str(inner / 'matched'),
                 '--disparities', '16', '--files', 'npy', '--keep']) == 0
    new = all_files(tmp_path) - before
    assert new and all(inner / 'matched' in path.parents for path in new)


def test_a_bag_leads_to_no_file_outside_its_folder(tmp_path, capsys):
    made_bags = pytest.importorskip('made_bags', reason='rosbags is not installed')
    made_bags.write_bag(tmp_path / 'secret', pairs=made_bags.scene(2))
    made_bags.write_bag(tmp_path / 'recorded', pairs=made_bags.scene(2))
    (stored,) = (tmp_path / 'recorded').glob('*.mcap')
    stored.unlink()
    metadata = tmp_path / 'recorded' / 'metadata.yaml'
    metadata.write_text(metadata.read_text().replace(stored.name, '../secret/secret.mcap'))
    assert main(['replay', str(tmp_path / 'recorded'), '--output', str(tmp_path / 'matched'),
                 '--disparities', '16']) == 2
    assert 'cannot be read as a bag' in capsys.readouterr().err
    assert not (tmp_path / 'matched').exists()


def test_a_bag_whose_description_asks_for_objects_makes_none(tmp_path, capsys):
    made_bags = pytest.importorskip('made_bags', reason='rosbags is not installed')
    made_bags.write_bag(tmp_path / 'recorded', pairs=made_bags.scene(1))
    (tmp_path / 'recorded' / 'metadata.yaml').write_text(
        f'!!python/object/apply:os.mkdir ["{tmp_path / "evil"}"]\n')
    assert main(['replay', str(tmp_path / 'recorded'), '--output', str(tmp_path / 'matched'),
                 '--disparities', '16']) == 2
    assert not (tmp_path / 'evil').exists()
