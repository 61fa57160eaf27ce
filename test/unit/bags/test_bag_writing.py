# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A bag that is written can be read, whatever ended its writing, and be continued."""
from contextlib import suppress
from shutil import copytree
import subprocess

from fuzzy_stereo_ros.bags import writing as bag_writing
from fuzzy_stereo_ros.bags.reading import BagReader
from fuzzy_stereo_ros.bags.writing import (
    BagWriter, CopiedMessages, FORMATS, Messages, METADATA, STORAGE_SUFFIXES, UNFINISHED)
from made_bags import BagOf, BEGIN, content, open_bag, same
import numpy as np
import pytest
from rosbags.convert.converter import LATCH
from rosbags.typesys import get_types_from_msg

KIND, TOPIC = 'sensor_msgs/msg/Image', '/picture'
MIB = 2**20
MESSAGES = Messages()


def write_one(bag, number):
    """Write a picture, logged at its number, which its pixels tell, too."""
    size = MIB // 4
    bag.write(TOPIC, KIND, MESSAGES.typestore, MESSAGES.content(MESSAGES.make(
        KIND, height=1, width=size, step=size, encoding='mono8',
        data=np.full(size, number, np.uint8))), number)
    bag.commit()


def write(folder, numbers, storage='mcap', close=True):
    """Write pictures and return the BagWriter."""
    bag = BagWriter(folder, storage)
    for number in numbers:
        write_one(bag, number)
    if close:
        bag.close()
    return bag


def numbers_of(folder):
    """Return the numbers of the pictures of a bag; each is checked to be the one it should be."""
    found = content(folder, TOPIC)
    assert all((message.data == log_time).all() for _, log_time, message in found)
    return [log_time for _, log_time, _ in found]


@pytest.mark.parametrize('storage', FORMATS)
@pytest.mark.parametrize('part, files', [(4 * MIB, 1), (MIB, 3)])
def test_what_is_written_is_read_and_counted_and_a_file_that_grows_large_followed_by_another(
        tmp_path, storage, monkeypatch, part, files):
    monkeypatch.setattr(bag_writing, 'PART_BYTES', part)
    bag = write(tmp_path / 'bag', range(10), storage)
    assert numbers_of(tmp_path / 'bag') == list(range(10))
    assert (bag.counts, bag.last) == ({TOPIC: 10}, 9)
    assert {path.name for path in (tmp_path / 'bag').iterdir()} == {
        METADATA, *(f'bag_{number}{STORAGE_SUFFIXES[storage]}' for number in range(files))}
    with open_bag(tmp_path / 'bag') as reader:
        assert (reader.start_time, reader.end_time) == (0, 10)
        assert reader.topics[TOPIC].msgcount == 10
        assert {connection.digest for connection in reader.connections} == {
            MESSAGES.typestore.hash_rihs01(KIND)}


@pytest.mark.parametrize('storage, part, left', [
    *((storage, MIB, 8) for storage in FORMATS), (FORMATS[0], 16 * MIB, 0)])
def test_a_bag_whose_writer_was_killed_has_its_whole_parts_and_is_continued(
        tmp_path, storage, part, left, monkeypatch):
    monkeypatch.setattr(bag_writing, 'PART_BYTES', part)
    killed, bag = tmp_path / 'killed' / 'bag', write(tmp_path / 'bag', range(9), storage,
                                                     close=False)
    copytree(tmp_path / 'bag', killed)      # what a process leaves that is killed now
    bag.close()
    assert (killed / UNFINISHED).exists()
    bag = BagWriter(killed, storage)
    assert (bag.counts[TOPIC], bag.last) == (left, left - 1 if left else None)
    assert not left or numbers_of(killed) == list(range(left))
    write(killed, range(left, 12), storage)
    assert numbers_of(killed) == list(range(12))
    assert not (killed / UNFINISHED).exists()


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
def test_whole_parts_stay_although_others_filled_the_disk_to_the_last_byte(
        disk, storage, monkeypatch):
    monkeypatch.setattr(bag_writing, 'PART_BYTES', MIB)
    bag = write(disk / 'bag', range(9), storage, close=False)
    with open(disk / 'others', 'wb', buffering=0) as others, suppress(OSError):
        while others.write(bytes(4096)):
            pass
    with pytest.raises(OSError, match='bag cannot be written any further: '):
        for number in range(9, 20):
            write_one(bag, number)
    assert numbers_of(disk / 'bag') == list(range(8))
    assert (bag.counts[TOPIC], bag.last) == (8, 7)
    assert {path.name for path in (disk / 'bag').iterdir()} == {
        METADATA, *(f'bag_{part}{STORAGE_SUFFIXES[storage]}' for part in range(2))}


def test_after_a_failure_nothing_more_is_written_and_no_second_one_raised(tmp_path):
    bag = BagWriter(tmp_path / 'file' / 'bag')
    (tmp_path / 'file').write_text('no folder')
    with pytest.raises(OSError, match='bag cannot be written any further: '):
        write_one(bag, 0)
    write_one(bag, 1)
    bag.close()
    assert bag.counts[TOPIC] == 0


@pytest.mark.parametrize('description', ['{', 'one: 1', 'rosbag2_bagfile_information: {files: 1}'])
def test_a_bag_with_a_damaged_description_is_not_continued(tmp_path, description):
    write(tmp_path / 'bag', range(3))
    (tmp_path / 'bag' / METADATA).write_text(description)
    with pytest.raises(ValueError, match=r'bag/metadata\.yaml is damaged: '):
        BagWriter(tmp_path / 'bag')


# ---- topics are copied as they are, and from ROS 1 so that ROS 2 reads the same values ----


def copied(target, *sources):
    """Copy whole bags and return the path of the copy."""
    with BagReader(sources) as bag:
        writer = BagWriter(target)
        for message, (kind, typestore, qualities, converted) in CopiedMessages(bag).until():
            writer.write(message.topic, kind, typestore, converted(message.content),
                         message.log_time, qualities)
        writer.close()
    return target


def imu(bag):
    """Return an Imu in which every number is another."""
    message = bag.make('sensor_msgs/msg/Imu', BEGIN + 5)
    message.linear_acceleration.x, message.angular_velocity.z = 1.25, -3.5
    message.orientation_covariance = np.arange(9, dtype=np.float64)
    return message


def test_messages_of_ros_2_are_copied_byte_for_byte_with_their_qos(tmp_path):
    with BagOf(tmp_path / 'bag') as bag:
        bag.write('/imu', imu(bag), BEGIN)
        bag.write('/tf_static', bag.make('tf2_msgs/msg/TFMessage'), BEGIN + 1,
                  offered_qos_profiles=LATCH)
    stored = []
    for path in (tmp_path / 'bag', copied(tmp_path / 'copy', tmp_path / 'bag')):
        with open_bag(path) as reader:
            stored.append([(one.topic, one.msgtype, one.ext, log_time, bytes(raw))
                           for one, log_time, raw in reader.messages()])
    assert stored[0] == stored[1] and stored[1][1][2].offered_qos_profiles == LATCH


def test_messages_of_ros_1_have_the_same_values_in_ros_2(tmp_path):
    """Latched ones are for those who come later; types of one's own keep their definition."""
    pixels, kind = np.arange(12, dtype=np.uint8).reshape(3, 4), 'own_msgs/msg/Thing'

    def several(bag):
        return {'/image': bag.image(pixels, BEGIN), '/info': bag.info('right', (3, 4), BEGIN),
                '/imu': imu(bag)}

    with BagOf(tmp_path / 'bag.bag', 'ros1') as bag:
        bag.typestore.register(get_types_from_msg(
            'std_msgs/Header header\nfloat32[] values\nint8 FEW=3\n', kind))
        written = several(bag) | {'/thing': bag.make(
            kind, BEGIN, values=np.array([1.5, 2.5], np.float32))}
        written['/image'].header.seq = 7
        for topic, message in written.items():
            bag.write(topic, message, BEGIN, latching=int(topic == '/info'))
    copied(tmp_path / 'copy', tmp_path / 'bag.bag')
    found = {topic: message for topic, _, message in content(tmp_path / 'copy')}
    with BagOf(tmp_path / 'as_if') as bag:
        assert all(same(found[topic], message) for topic, message in several(bag).items())
    thing = found['/thing']
    assert (thing.values.tolist(), thing.FEW) == ([1.5, 2.5], 3)
    assert thing.header.frame_id == 'left_optical' and not hasattr(thing.header, 'seq')
    with open_bag(tmp_path / 'copy') as reader:
        qualities = {one.topic: one.ext.offered_qos_profiles for one in reader.connections}
    assert qualities.pop('/info') == LATCH
    assert not any(qualities.values())


def test_a_type_without_definition_cannot_be_copied(tmp_path):
    with BagOf(tmp_path / 'bag') as bag:
        bag.typestore.register(get_types_from_msg('int32 a\n', 'own_msgs/msg/Thing'))
        bag.write('/thing', bag.make('own_msgs/msg/Thing'), BEGIN)
    with BagReader([tmp_path / 'bag']) as bag:
        ((_, reader),) = bag.connections('/thing')
        del reader.typestore.fielddefs['own_msgs/msg/Thing']
        with pytest.raises(ValueError, match='/thing cannot be copied: the bag does not define '
                                             'its type own_msgs/msg/Thing'):
            CopiedMessages(bag, ['/thing'])
