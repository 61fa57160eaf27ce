# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Bags of every kind give the same stream of messages, up to where they are damaged."""
from fuzzy_stereo_ros.bags.reading import BagReader, BagTopic, read_stamped
from fuzzy_stereo_ros.pairs.messages import read_image, stamp_of
from made_bags import (
    BagOf, BEGIN, FORMATS, LATER, name_of, scene, stamps, STEP, TOPICS, write_bag)
import numpy as np
import pytest

IMAGE, INFO = 'sensor_msgs/msg/Image', 'sensor_msgs/msg/CameraInfo'


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    """Return a folder with the same bag in each format, under the format's name."""
    folder = tmp_path_factory.mktemp('bags')
    for form in FORMATS:
        write_bag(folder / name_of(form), form)
    return folder


def rejection_of(*paths):
    with pytest.raises(ValueError) as rejection:
        BagReader(paths)
    return str(rejection.value)


@pytest.mark.parametrize('name', ['bag.bag', 'sqlite3', 'mcap', 'sqlite3/sqlite3.db3',
                                  'mcap/mcap.mcap'])
def test_every_kind_of_bag_gives_topics_times_and_the_bits_of_the_images(folder, name):
    with BagReader([folder / name]) as bag:
        assert bag.topics == {topic: BagTopic(kind, 6)
                              for topic, kind in zip(TOPICS, (IMAGE, INFO) * 2)}
        assert bag.begin == BEGIN + LATER
        assert bag.end == BEGIN + 5 * STEP + LATER + 3
        messages = list(bag.messages([TOPICS[0]]))
        found = [read_stamped(message)[1] for message in messages]
    assert [message.log_time for message in messages] == [stamp + LATER for stamp in stamps()]
    assert [stamp_of(message.header) for message in found] == stamps()
    for message, pair in zip(found, scene()):
        np.testing.assert_array_equal(read_image(message), pair.left)


@pytest.mark.parametrize('form', FORMATS)
def test_topics_are_told_without_those_that_a_terminal_would_obey(tmp_path, form):
    with BagOf(tmp_path / name_of(form), form) as bag:
        for topic in ('/said', '/\x1b[2J', '/said\n[INFO] all is well'):
            bag.write(topic, bag.make('std_msgs/msg/Int32', data=1), BEGIN)
    with BagReader([tmp_path / name_of(form)]) as bag:
        assert list(bag.topics) == ['/said']


@pytest.mark.parametrize('gap', [10**6, 3 * 10**8, 10**10, 10**12])
def test_the_newest_message_before_a_time_is_found_however_far_back_it_is(tmp_path, gap):
    times = [BEGIN, BEGIN + 5, BEGIN + 5 + gap]
    with BagOf(tmp_path / 'bag') as bag:
        for log_time in times:
            bag.write('/tf', bag.make('tf2_msgs/msg/TFMessage'), log_time)
    with BagReader([tmp_path / 'bag']) as bag:
        newest = [[one.log_time for one in bag.newest('/tf', time)] for time in (
            BEGIN, *(time + 1 for time in times), times[2], times[2] + 3 * gap)]
        assert newest == [[], *([time] for time in times), [times[1]], [times[2]]]
        for count in (2, 3, 4):
            assert [one.log_time for one in bag.newest('/tf', times[2] + 1, count)] == \
                times[-count:]


def test_what_is_no_bag_is_rejected_with_a_sentence(folder, tmp_path):
    (tmp_path / 'text.txt').write_text('text')
    (tmp_path / 'text.mcap').write_text('no bag at all, but a text that is long enough for one')
    (tmp_path / 'text.db3').write_text('text')
    (tmp_path / 'empty.bag').write_bytes(b'')
    (tmp_path / 'folder').mkdir()
    write_bag(tmp_path / 'nothing', pairs=[])
    assert 'missing.bag does not exist; give a bag' in rejection_of(tmp_path / 'missing.bag')
    assert "has the suffix '.txt'; bags have .bag, .bag.active, .mcap, .db3" in rejection_of(
        tmp_path / 'text.txt')
    assert 'folder is a folder without metadata.yaml' in rejection_of(tmp_path / 'folder')
    assert 'nothing has no messages' in rejection_of(tmp_path / 'nothing')
    for name in ('text.mcap', 'text.db3', 'empty.bag'):
        assert f'{name} cannot be read as a bag' in rejection_of(tmp_path / name)
        assert f'{name} cannot be read as a bag' in rejection_of(
            folder / 'mcap', tmp_path / name)


@pytest.mark.parametrize('name', ['bag.mcap.zstd', 'bag_0.db3.zstd', 'bag.mcap.zst'])
def test_a_file_that_was_compressed_alone_is_rejected_with_what_unpacks_it(tmp_path, name):
    (tmp_path / name).write_bytes(b'\x28\xb5\x2f\xfd')
    for path in (tmp_path / name, tmp_path):
        assert rejection_of(path) == (
            f'{tmp_path / name} is compressed; unpack it: zstd -d {tmp_path / name}')


def test_companions_of_macos_in_a_folder_are_no_bags(folder, tmp_path):
    for form in ('mcap', 'sqlite3'):
        file = next((folder / form).glob(f'{form}.*'))
        (tmp_path / form).mkdir()
        (tmp_path / form / file.name).write_bytes(file.read_bytes())
        (tmp_path / form / f'._{file.name}').write_bytes(b'\0\5\x16\7')
        for described in (False, True):
            if described:
                (tmp_path / form / 'metadata.yaml').write_bytes(
                    (folder / form / 'metadata.yaml').read_bytes())
            with BagReader([tmp_path / form]) as bag:
                assert len(list(bag.messages(TOPICS))) == 24 and not bag.losses
