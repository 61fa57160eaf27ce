# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Topics are copied as they are, and from ROS 1 so that ROS 2 reads the same values."""
from fuzzy_stereo_ros.bags.reading import BagReader
from fuzzy_stereo_ros.bags.writing import BagWriter, CopiedMessages
from made_bags import BagOf, BEGIN, content, open_bag, same
import numpy as np
import pytest
from rosbags.interfaces import (
    Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime)
from rosbags.typesys import get_types_from_msg

FOREVER = QosTime(2147483647, 4294967295)
LATCHED = [Qos(QosHistory.KEEP_LAST, 1, QosReliability.RELIABLE, QosDurability.TRANSIENT_LOCAL,
               FOREVER, FOREVER, QosLiveliness.AUTOMATIC, FOREVER,
               avoid_ros_namespace_conventions=False)]


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
                  offered_qos_profiles=LATCHED)
    copied(tmp_path / 'copy', tmp_path / 'bag')
    stored = []
    for path in ('bag', 'copy'):
        with open_bag(tmp_path / path) as reader:
            stored.append([(one.topic, one.msgtype, one.ext, log_time, bytes(raw))
                           for one, log_time, raw in reader.messages()])
    assert stored[0] == stored[1]
    assert stored[1][1][2].offered_qos_profiles == LATCHED


def test_messages_of_ros_1_have_the_same_values_in_ros_2(tmp_path):
    with BagOf(tmp_path / 'bag.bag', 'ros1') as bag:
        image = bag.image(np.arange(12, dtype=np.uint8).reshape(3, 4), BEGIN)
        image.header.seq = 7
        bag.write('/image', image, BEGIN)
        bag.write('/info', bag.info('right', (3, 4), BEGIN), BEGIN + 1)
        bag.write('/imu', imu(bag), BEGIN + 2)
    found = {topic: message for topic, _, message in content(
        copied(tmp_path / 'copy', tmp_path / 'bag.bag'))}
    with BagOf(tmp_path / 'as_if') as bag:
        assert same(found['/image'], bag.image(
            np.arange(12, dtype=np.uint8).reshape(3, 4), BEGIN))
        assert same(found['/info'], bag.info('right', (3, 4), BEGIN))
        assert same(found['/imu'], imu(bag))


def test_latched_topics_of_ros_1_are_for_those_who_come_later_in_ros_2(tmp_path):
    with BagOf(tmp_path / 'bag.bag', 'ros1') as bag:
        bag.write('/latched', bag.make('std_msgs/msg/Int32', data=4), BEGIN, latching=1)
        bag.write('/plain', bag.make('std_msgs/msg/Int32', data=5), BEGIN)
    copied(tmp_path / 'copy', tmp_path / 'bag.bag')
    with open_bag(tmp_path / 'copy') as reader:
        qualities = {one.topic: one.ext.offered_qos_profiles for one in reader.connections}
    assert qualities['/plain'] == []
    assert qualities['/latched'][0].durability is QosDurability.TRANSIENT_LOCAL


def test_a_type_that_ros_2_does_not_know_keeps_its_definition(tmp_path):
    kind = 'own_msgs/msg/Thing'
    with BagOf(tmp_path / 'bag.bag', 'ros1') as bag:
        bag.typestore.register(get_types_from_msg(
            'std_msgs/Header header\nfloat32[] values\nint8 FEW=3\n', kind))
        thing = bag.make(kind, BEGIN, values=np.array([1.5, 2.5], np.float32))
        bag.write('/thing', thing, BEGIN)
    ((_, _, found),) = content(copied(tmp_path / 'copy', tmp_path / 'bag.bag'))
    assert (found.values.tolist(), found.FEW) == ([1.5, 2.5], 3)
    assert found.header.frame_id == 'left_optical'
    assert not hasattr(found.header, 'seq')


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
