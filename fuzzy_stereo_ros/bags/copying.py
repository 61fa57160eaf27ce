# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Copy topics of a bag, of ROS 1 or ROS 2, into a bag of ROS 2."""
from collections.abc import Callable
from typing import NamedTuple

from fuzzy_stereo_ros.bags.reading import slashed

RENAMED = {'tf/msg/tfMessage': 'tf2_msgs/msg/TFMessage'}
HEADER = 'std_msgs/msg/Header'


class Copying(NamedTuple):
    """How the messages of a connection are copied; the first three: see `BagWriter.write`."""

    kind: str
    typestore: object
    qualities: list
    converted: Callable     # from the bytes of a message to CDR


class CopiedMessages:
    """The messages of topics, a list, to be copied; nobody else must read the BagReader."""

    def __init__(self, bags, names=(), results=(), start=None, stop=None):
        """
        Choose the topics to copy.

        names: of these topics; () = all but the results. results: names of topics that the
        replay writes itself. start, stop: ns, as for `BagReader.messages`.
        Raises ValueError for a topic that is missing, is a result, or cannot be copied.
        """
        self.topics = [slashed(name) for name in names] or [
            topic for topic in bags.topics if topic not in results]
        for topic in self.topics:
            if topic not in bags.topics:
                raise ValueError(f'--keep names {topic}, which is not in {bags.names}; there are '
                                 f"{', '.join(sorted(bags.topics))}")
            if topic in results:
                raise ValueError(f'--keep names {topic}, under which the results are written')
        # By reader too, as bags of ROS 1 and ROS 2 may be read together.
        self._copyings = {(topic, id(reader)): _copying_of(topic, connection, reader)
                          for topic in self.topics
                          for connection, reader in bags.connections(topic)}
        self._messages, self._next = bags.messages(self.topics, start, stop), None

    def until(self, log_time=None):
        """Yield (BagMessage, its Copying) up to a time in ns, None = the end; DamagedBag."""
        while True:
            self._next = self._next or next(self._messages, None)
            if self._next is None or (log_time is not None and self._next.log_time > log_time):
                return
            message, self._next = self._next, None
            yield message, self._copyings[message.topic, id(message.reader)]


def _copying_of(topic, connection, reader):
    kind = connection.msgtype
    if kind not in reader.typestore.fielddefs:
        raise ValueError(f'{topic} cannot be copied: the bag does not define its type {kind}; '
                         'name the topics to keep without it')
    if reader.is2:
        return Copying(kind, reader.typestore, connection.ext.offered_qos_profiles, bytes)
    from rosbags.convert.converter import is_same_wireformat, LATCH

    from rosbags.typesys import get_typestore, Stores

    typestore, new = get_typestore(Stores.ROS2_JAZZY), RENAMED.get(kind, kind)
    if new not in typestore.fielddefs or not is_same_wireformat(
            reader.typestore, typestore, kind, new):
        header, new = typestore.fielddefs[HEADER], kind
        typestore = get_typestore(Stores.EMPTY)
        typestore.register({**reader.typestore.fielddefs, HEADER: header})

    def converted(content):
        return typestore.ros1_to_cdr(content, new)

    return Copying(new, typestore, LATCH if connection.ext.latching else [], converted)
