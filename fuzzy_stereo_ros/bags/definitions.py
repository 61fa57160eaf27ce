# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Whether a bag defines types of messages as ROS does: one that is damaged does not."""
from functools import cache


def defined_as_in_ros(defined, kind):
    """
    Return whether a type has all fields that ROS 1 or ROS 2 gives it; types of others always.

    defined: {name: fields} of a bag's types, `fielddefs` of rosbags. kind: name of the type.
    """
    stores = [store for store in _types_of_ros() if kind in store]
    return not stores or any(_has_fields(defined, store, kind) for store in stores)


def _has_fields(defined, store, kind):
    fields = dict(defined[kind][1]) if kind in defined else {}
    return all(fields.get(name) == what and
               (what[1] not in store or _has_fields(defined, store, what[1]))
               for name, what in store[kind][1])


@cache
def _types_of_ros():
    from rosbags.typesys import get_typestore, Stores
    return [get_typestore(store).fielddefs for store in (Stores.ROS2_JAZZY, Stores.ROS1_NOETIC)]
