# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Quality of service: what the words of the parameters mean, and what may be overridden."""
from copy import copy

from rclpy.qos import (
    DurabilityPolicy, HistoryPolicy, QoSPolicyKind, QoSPresetProfiles, QoSProfile,
    ReliabilityPolicy)
from rclpy.qos_overriding_options import QoSOverridingOptions

OVERRIDABLE = QoSOverridingOptions((
    QoSPolicyKind.HISTORY, QoSPolicyKind.DEPTH, QoSPolicyKind.RELIABILITY,
    QoSPolicyKind.DURABILITY))
# Of camera_info that was published once, before anybody listened.
LATCHED = QoSProfile(
    history=HistoryPolicy.KEEP_LAST, depth=1, reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL)
SENSOR_DATA = QoSPresetProfiles.SENSOR_DATA.value
SYSTEM_DEFAULT = QoSPresetProfiles.SYSTEM_DEFAULT.value
INPUTS = {
    'sensor_data': SENSOR_DATA,
    'reliable': QoSProfile(
        history=HistoryPolicy.KEEP_LAST, depth=5, reliability=ReliabilityPolicy.RELIABLE),
    'best_available': QoSPresetProfiles.BEST_AVAILABLE.value,
    'system_default': SYSTEM_DEFAULT,
}
OUTPUTS = {
    'reliable': QoSProfile(
        history=HistoryPolicy.KEEP_LAST, depth=1, reliability=ReliabilityPolicy.RELIABLE),
    'sensor_data': SENSOR_DATA,
    'latched': LATCHED,
    'system_default': SYSTEM_DEFAULT,
}


def input_quality(settings):
    """Return a QoSProfile for one of the inputs, by the settings of the node."""
    word = 'system_default' if settings['use_system_default_qos'] else settings['input_qos']
    return copy(INPUTS[word])      # rclpy writes the overrides of a topic into it


def output_quality(settings):
    """Return a QoSProfile for one of the outputs, by the settings of the node."""
    return copy(OUTPUTS[settings['output_qos']])


def is_best_available(quality, policy):
    """Return whether the publishers decide on a policy of a QoSProfile, by its name."""
    return getattr(getattr(quality, policy, None), 'name', '') == 'BEST_AVAILABLE'
