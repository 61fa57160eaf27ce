# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Topics of a bag, of ROS 1 or ROS 2, into a bag of ROS 2."""
from collections.abc import Callable
from typing import NamedTuple

RENAMED = {'tf/msg/tfMessage': 'tf2_msgs/msg/TFMessage'}
HEADER = 'std_msgs/msg/Header'


class Copying(NamedTuple):
    """
    How the messages of a connection are copied.

    kind, typestore, qualities: as of `BagWriter.write`. converted: from stored bytes to CDR.
    """

    kind: str
    typestore: object
    qualities: list
    converted: Callable


class Copies:
    """
    Topics to be copied out of bags.

    topics: names, all of a bag of ROS 2.
    """

    def __init__(self, bags, topics):
        """
        See that topics of a BagReader can be copied.

        Raises ValueError where a bag does not tell what a type looks like.
        """
        self.topics = tuple(topics)
        # By reader too: bags of ROS 1 and ROS 2 may be read as one.
        self._copyings = {(topic, id(reader)): _copying_of(topic, connection, reader)
                          for topic in topics for connection, reader in bags.connections(topic)}

    def of(self, message):
        """Return the Copying of a BagMessage."""
        return self._copyings[message.topic, id(message.reader)]


def _copying_of(topic, connection, reader):
    kind = connection.msgtype
    if kind not in reader.typestore.fielddefs:
        raise ValueError(f'{topic} cannot be copied: the bag does not define its type {kind}; '
                         'name the topics to keep without it')
    if reader.is2:
        return Copying(kind, reader.typestore, connection.ext.offered_qos_profiles, bytes)
    from rosbags.convert.converter import LATCH

    kind, typestore = _in_ros_2(kind, reader)

    def converted(content):
        return typestore.ros1_to_cdr(content, kind)

    return Copying(kind, typestore, LATCH if connection.ext.latching else [], converted)


def _in_ros_2(kind, reader):
    """Return type and typestore for the bytes of a ROS 1 type: Jazzy's where they are alike."""
    from rosbags.convert.converter import is_same_wireformat
    from rosbags.typesys import get_typestore, Stores

    jazzy = get_typestore(Stores.ROS2_JAZZY)
    new = RENAMED.get(kind, kind)
    if new in jazzy.fielddefs and is_same_wireformat(reader.typestore, jazzy, kind, new):
        return new, jazzy
    typestore = get_typestore(Stores.EMPTY)
    typestore.register({**reader.typestore.fielddefs, HEADER: jazzy.fielddefs[HEADER]})
    return kind, typestore
