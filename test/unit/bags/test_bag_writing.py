# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A bag that is written can be read, whatever ended its writing, and be continued."""
from contextlib import suppress
import os
import signal
import subprocess
import sys

from fuzzy_stereo_ros.bags import writing as bag_writing
from fuzzy_stereo_ros.bags.parts import MCAP_END, MCAP_START, rescue, SUFFIXES
from fuzzy_stereo_ros.bags.reading import BagReader
from fuzzy_stereo_ros.bags.writing import BagFolder, FORMATS, Messages, UNFINISHED
from hypothesis import given, settings, strategies as st
from made_bags import content, open_bag
import numpy as np
import pytest
from repository import ROOT

KIND, TOPIC = 'sensor_msgs/msg/Image', '/picture'
MIB = 2**20
MESSAGES = Messages()


def picture(number, size=MIB // 4):
    """Return the bytes of an Image whose pixels tell its number."""
    return MESSAGES.content(MESSAGES.make(
        KIND, height=1, width=size, step=size, encoding='mono8',
        data=np.full(size, number % 251, np.uint8)))


def write(folder, numbers, storage='mcap', size=MIB // 4, close=True):
    """Write pictures, each logged at its number, and return the BagFolder."""
    bag = BagFolder(folder, storage)
    for number in numbers:
        bag.write(TOPIC, KIND, MESSAGES.typestore, picture(number, size), number)
        bag.commit()
    if close:
        bag.close()
    return bag


def numbers_of(folder):
    """Return the numbers of the pictures of a bag; each is checked to be the one it should be."""
    found = content(folder, TOPIC)
    assert all((message.data == logged % 251).all() for _, logged, message in found)
    return [logged for _, logged, _ in found]


@pytest.mark.parametrize('storage', FORMATS)
def test_what_is_written_is_read_and_counted(tmp_path, storage):
    bag = write(tmp_path / 'bag', range(10), storage)
    assert numbers_of(tmp_path / 'bag') == list(range(10))
    assert (bag.counts, bag.last) == ({TOPIC: 10}, 9)
    suffix = {'mcap': 'mcap', 'sqlite3': 'db3'}[storage]
    assert {path.name for path in (tmp_path / 'bag').iterdir()} == {
        'metadata.yaml', f'bag_0.{suffix}'}
    # The end of a rescued file has no index.
    assert not (tmp_path / 'bag' / f'bag_0.{suffix}').read_bytes().endswith(MCAP_END)
    with open_bag(tmp_path / 'bag') as reader:
        assert (reader.start_time, reader.end_time) == (0, 10)
        assert reader.topics[TOPIC].msgcount == 10
        (connection,) = reader.connections
        assert connection.digest == MESSAGES.typestore.hash_rihs01(KIND)


@pytest.mark.parametrize('storage', FORMATS)
@pytest.mark.parametrize('name', ['drive #2', 'what?', '100%41', 'left=right&a:b'])
def test_a_folder_may_have_a_name_that_means_something_in_a_uri(tmp_path, storage, name):
    folder = tmp_path / name / name
    folder.parent.mkdir()
    write(folder, range(3), storage)
    write(folder, range(3, 5), storage)
    for path, numbers in ((folder, range(5)),
                          (folder / f'{name}_1{SUFFIXES[storage]}', range(3, 5))):
        with BagReader([path]) as bag:
            assert [one.logged for one in bag.messages([TOPIC])] == list(numbers)
    assert list(tmp_path.iterdir()) == [folder.parent]
    assert list(folder.parent.iterdir()) == [folder]


def test_nothing_is_written_before_a_message_is(tmp_path):
    BagFolder(tmp_path / 'bag').close()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize('storage', FORMATS)
def test_a_file_that_grows_large_is_followed_by_another_of_the_same_bag(
        tmp_path, storage, monkeypatch):
    monkeypatch.setattr(bag_writing, 'PART_BYTES', 2 * MIB)
    write(tmp_path / 'bag', range(40), storage)
    assert len(list((tmp_path / 'bag').glob('bag_*'))) in (4, 5)
    assert numbers_of(tmp_path / 'bag') == list(range(40))


@pytest.mark.parametrize('storage', FORMATS)
def test_a_bag_is_continued_by_a_further_file(tmp_path, storage):
    for begin in (0, 4, 8):
        bag = write(tmp_path / 'bag', range(begin, begin + 4), storage)
        assert (bag.counts[TOPIC], bag.last) == (begin + 4, begin + 3)
    assert numbers_of(tmp_path / 'bag') == list(range(12))


def test_files_are_continued_in_the_order_of_their_numbers(tmp_path):
    for number in range(12):
        write(tmp_path / 'bag', [number], size=16)
    assert numbers_of(tmp_path / 'bag') == list(range(12))


KILLED = """\
import os, signal, sys
sys.path[:0] = 'test/support', 'test/unit/bags'
from test_bag_writing import write
write(sys.argv[1], range(int(sys.argv[3])), sys.argv[2], close=False)
os.kill(os.getpid(), signal.SIGKILL)
"""
FULL = """\
import resource, sys
sys.path[:0] = 'test/support', 'test/unit/bags'
from test_bag_writing import write
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[3]), resource.RLIM_INFINITY))
try:
    write(sys.argv[1], range(40), sys.argv[2])
except OSError as error:
    print(error)
"""


def run(code, *arguments):
    """Run Python code in the project's folder and return what it ended with."""
    return subprocess.run([sys.executable, '-c', code, *map(str, arguments)], cwd=ROOT,
                          capture_output=True, text=True, env={**os.environ})


@pytest.mark.parametrize('storage', FORMATS)
def test_a_bag_whose_writer_was_killed_is_rescued_and_continued(tmp_path, storage):
    assert run(KILLED, tmp_path / 'bag', storage, 9).returncode == -signal.SIGKILL
    bag = BagFolder(tmp_path / 'bag', storage)
    left = numbers_of(tmp_path / 'bag')
    # A chunk of an mcap that was not full is lost: four pictures and a bit fill one.
    assert left == list(range(9 if storage == 'sqlite3' else 8))
    assert (bag.counts[TOPIC], bag.last) == (len(left), left[-1])
    assert not (tmp_path / 'bag' / UNFINISHED).exists()
    write(tmp_path / 'bag', range(len(left), 12), storage)
    assert numbers_of(tmp_path / 'bag') == list(range(12))


def test_a_bag_whose_writer_was_killed_before_its_first_chunk_is_begun_anew(tmp_path):
    assert run(KILLED, tmp_path / 'bag', 'mcap', 1).returncode == -signal.SIGKILL
    write(tmp_path / 'bag', range(3))
    assert numbers_of(tmp_path / 'bag') == [0, 1, 2]
    assert not (tmp_path / 'bag' / UNFINISHED).exists()


@pytest.mark.parametrize('storage', FORMATS)
@pytest.mark.parametrize('begun', [None, b'', MCAP_START, MCAP_START + b'\x01\x40'])
def test_what_was_begun_and_holds_nothing_is_no_obstacle(tmp_path, storage, begun):
    place = tmp_path / 'bag' / UNFINISHED / 'bag_0'
    place.mkdir(parents=True)
    if begun is not None:
        (place / f'bag_0{SUFFIXES[storage]}').write_bytes(b'' if storage == 'sqlite3' else begun)
    write(tmp_path / 'bag', range(3), storage)
    assert numbers_of(tmp_path / 'bag') == [0, 1, 2]


@pytest.mark.parametrize('storage', FORMATS)
@pytest.mark.parametrize('room', [5 * MIB, 5 * MIB + 12345, 3 * MIB + 1])
def test_where_the_disk_is_full_what_was_written_is_a_bag(tmp_path, storage, room):
    ended = run(FULL, tmp_path / 'bag', storage, room)
    assert f'{tmp_path}/bag cannot be written any further: ' in ended.stdout, ended.stderr
    left = numbers_of(tmp_path / 'bag')
    assert left == list(range(len(left)))
    assert len(left) * MIB / 4 > room - 2.5 * MIB
    write(tmp_path / 'bag', range(len(left), 40), storage)
    assert numbers_of(tmp_path / 'bag') == list(range(40))


def test_a_disk_that_is_full_to_the_last_byte_costs_a_chunk(tmp_path):
    run(KILLED, tmp_path / 'bag', 'mcap', 9)
    room = (tmp_path / 'bag' / UNFINISHED / 'bag_0' / 'bag_0.mcap').stat().st_size
    assert run(FULL, tmp_path / 'full', 'mcap', room).stdout
    assert numbers_of(tmp_path / 'full') == list(range(4))


@pytest.mark.parametrize('storage', FORMATS)
@pytest.mark.parametrize('room', [0, 1, 5000])
def test_where_the_disk_was_full_before_the_first_message_there_is_no_bag(tmp_path, storage, room):
    ended = run(FULL, tmp_path / 'bag', storage, room)
    assert f'{tmp_path}/bag cannot be written any further: ' in ended.stdout, ended.stderr
    assert list((tmp_path / 'bag').iterdir()) == []
    write(tmp_path / 'bag', range(4), storage)
    assert numbers_of(tmp_path / 'bag') == list(range(4))


@pytest.fixture
def disk(tmp_path):
    """Return the folder of a file system of 4 MiB, which must be allowed."""
    place = tmp_path / 'disk'
    place.mkdir()
    mounted = subprocess.run(['mount', '-t', 'tmpfs', '-o', 'size=4m', 'none', place],
                             capture_output=True, text=True)
    if mounted.returncode:
        pytest.skip(f'no file system may be mounted here: {mounted.stderr.strip()}')
    yield place
    # lazily: before Python 3.11 SQLite keeps a file open whose connection closed on a full disk
    subprocess.run(['umount', '--lazy', place], check=True)


@pytest.mark.parametrize('storage', FORMATS)
def test_a_bag_can_end_although_others_filled_the_disk_to_the_last_byte(disk, storage):
    bag = write(disk / 'bag', range(9), storage, close=False)
    with open(disk / 'others', 'wb', buffering=0) as others, suppress(OSError):
        while others.write(bytes(4096)):
            pass
    with pytest.raises(OSError, match='bag cannot be written any further: '):
        for number in range(9, 20):
            bag.write(TOPIC, KIND, MESSAGES.typestore, picture(number), number)
            bag.commit()
    assert numbers_of(disk / 'bag') == list(range(9 if storage == 'sqlite3' else 8))
    assert bag.counts[TOPIC] == len(numbers_of(disk / 'bag'))
    assert {path.name for path in (disk / 'bag').iterdir()} == {
        'metadata.yaml', f'bag_0{SUFFIXES[storage]}'}


def test_after_a_failure_nothing_more_is_written_and_no_second_one_raised(tmp_path):
    bag = BagFolder(tmp_path / 'file' / 'bag')
    (tmp_path / 'file').write_text('no folder')
    with pytest.raises(OSError, match='bag cannot be written any further: '):
        bag.write(TOPIC, KIND, MESSAGES.typestore, picture(0), 0)
    bag.write(TOPIC, KIND, MESSAGES.typestore, picture(1), 1)
    bag.commit()
    bag.close()
    assert bag.counts[TOPIC] == 0


def test_a_file_that_is_none_is_refused_when_its_bag_is_continued(tmp_path):
    (tmp_path / 'bag_0.mcap').write_text('not an mcap at all, but long enough for its end: ' * 2)
    with pytest.raises(ValueError, match=r'bag_0\.mcap cannot be read as a bag'):
        BagFolder(tmp_path)


@pytest.fixture(scope='module')
def whole(tmp_path_factory):
    """Return the bytes of a file of 60 pictures in about ten chunks."""
    folder = tmp_path_factory.mktemp('whole')
    write(folder / 'bag', range(60), size=MIB // 6)
    return (folder / 'bag' / 'bag_0.mcap').read_bytes()


@given(share=st.floats(0, 1))
@settings(max_examples=60, deadline=None)
def test_a_file_that_was_cut_anywhere_has_all_whole_chunks_after_its_rescue(
        whole, tmp_path_factory, share):
    path = tmp_path_factory.mktemp('cut') / 'cut.mcap'
    size = max(int(share * len(whole)), 60)
    path.write_bytes(whole[:size])
    rescue(path)
    with open_bag(path) as reader:
        left = [(logged, bytes(raw)) for _, logged, raw in reader.messages()]
    assert left == [(number, bytes(picture(number, MIB // 6))) for number in range(len(left))]
    # The last chunk, what is not in a whole one, and the index behind them.
    assert len(left) * MIB / 6 > min(size, 10 * MIB) - 1.4 * MIB
    path.unlink()


def test_the_rescue_of_a_whole_file_changes_nothing(whole, tmp_path):
    path = tmp_path / 'whole.mcap'
    path.write_bytes(whole)
    rescue(path)
    assert path.read_bytes() == whole
    path.write_bytes(whole[:len(whole) // 2])
    rescue(path)
    once = path.read_bytes()
    assert once.endswith(MCAP_END)
    rescue(path)
    assert path.read_bytes() == once
