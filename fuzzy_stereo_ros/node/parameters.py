# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Declare the table of parameters to ROS; accept changes completely or not at all."""
from copy import copy
from dataclasses import replace

from fuzzy_stereo_ros.matching import MatcherConfig, PROFILES
from fuzzy_stereo_ros.parameters.table import (
    IGNORED_PARAMETERS, in_ros_words, nearest, NODE_PARAMETERS, ros_name, ROS_PARAMETERS)
from rcl_interfaces.msg import (
    FloatingPointRange, IntegerRange, ParameterDescriptor, SetParametersResult)
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSPolicyKind, QoSPresetProfiles, QoSProfile
from rclpy.qos_overriding_options import QoSOverridingOptions

QOS_OVERRIDES = 'qos_overrides.'    # ROS declares these with each publisher and subscription
LIKENESS = 0.9          # for a suggestion among these names, which all have long parts in common
FIELDS = {row.name: row.field for row in ROS_PARAMETERS if row.field}   # of MatcherConfig
OVERRIDABLE = QoSOverridingOptions((
    QoSPolicyKind.HISTORY, QoSPolicyKind.DEPTH, QoSPolicyKind.RELIABILITY,
    QoSPolicyKind.DURABILITY))


def qos_profile(word, depth=1):
    """Return the QoSProfile for a value of input_qos or output_qos; depth: of `reliable`."""
    if word == 'reliable':
        return QoSProfile(depth=depth)
    if word == 'latched':
        return QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    # A copy, as rclpy writes the overrides of a topic into it.
    return copy(QoSPresetProfiles.get_from_short_key(word))


class NodeParameters:
    """
    The parameters of a node and the MatcherConfig made of them.

    config: the MatcherConfig of the parameters' present values. settings: {name: value} of those
    fixed at start. ignored: names of stereo_image_proc's parameters that were set at start.
    unknown: names that were set at start and are no parameters, each with a suggestion.
    """

    def __init__(self, node, on_change, on_ignored):
        """Declare all; on_change(config), on_ignored(names): of later changes; ValueError."""
        self._node, self._on_change, self._on_ignored = node, on_change, on_ignored
        self.settings = {row.name: self._declare(row, row.checked(self._override(row)))
                         for row in NODE_PARAMETERS}
        self._profile = self.settings.pop('profile')
        self.config = self._declare_matcher(MatcherConfig.from_profile(self._profile))
        meaningless = ParameterDescriptor(
            description="of stereo_image_proc's matchers; accepted and ignored",
            dynamic_typing=True)
        self.ignored = [name for name in IGNORED_PARAMETERS
                        if node.declare_parameter(name, None, meaningless).value is not None]
        self.unknown = [name + nearest(name) for name in self._never_declared()
                        if not name.startswith(QOS_OVERRIDES)]
        node.add_pre_set_parameters_callback(self._add_presets)
        node.add_on_set_parameters_callback(self._check)
        node.add_post_set_parameters_callback(self._apply)

    def unused_overrides(self):
        """Return names of QoS overrides for topics the node lacks, each with a suggestion."""
        topics = list(self._node.get_parameters_by_prefix(QOS_OVERRIDES.rstrip('.')))
        return [name + nearest(name, [QOS_OVERRIDES + topic for topic in topics], LIKENESS)
                for name in self._never_declared() if name.startswith(QOS_OVERRIDES)]

    def _never_declared(self):
        # rclpy has no public list of the overrides that were never declared.
        return [name for name in sorted(self._node._parameter_overrides)
                if not self._node.has_parameter(name)]

    def _declare_matcher(self, preset):
        rows = [replace(row, default=getattr(preset, row.field))
                for row in ROS_PARAMETERS if row.field]
        values = {row.name: self._override(row) for row in rows}
        config = self._changed_config(preset, values)
        for row in rows:
            self._declare(row, values[row.name])
        return config

    def _declare(self, row, value):
        descriptor = ParameterDescriptor(description=row.described(), read_only=row.read_only)
        if row.low is not None and isinstance(row.default, float):
            descriptor.floating_point_range = [
                FloatingPointRange(from_value=float(row.low), to_value=float(row.high))]
        elif row.low is not None:
            descriptor.integer_range = [
                IntegerRange(from_value=row.low, to_value=row.high, step=1)]
        self._node.declare_parameter(row.name, value, descriptor, ignore_override=True)
        return value

    def _override(self, row):
        """Return the value that the user set at start, of any type, else the row's default."""
        any_type = ParameterDescriptor(dynamic_typing=True)
        value = self._node.declare_parameter(row.name, row.default, any_type).value
        self._node.undeclare_parameter(row.name)
        whole_for_float = isinstance(row.default, float) and type(value) is int
        return float(value) if whole_for_float else value

    def _changed_config(self, config, values):
        """Return a MatcherConfig with changed {ROS name: value}; ValueError with ROS names."""
        try:
            return replace(config, **{FIELDS[name]: value
                                      for name, value in values.items() if name in FIELDS})
        except ValueError as error:
            raise ValueError(in_ros_words(str(error))) from None

    def _add_presets(self, parameters):
        """Return parameters with the presets of a new profile that they do not set themselves."""
        given = {parameter.name: parameter.value for parameter in parameters}
        if given.get('profile', self._profile) == self._profile:
            return parameters
        try:
            presets = MatcherConfig.from_profile(given['profile'])
        except (ValueError, TypeError):
            return parameters       # `_check` rejects it
        return parameters + [
            Parameter(ros_name(name), value=getattr(presets, name))
            for name in {*PROFILES[self._profile], *PROFILES[given['profile']]}
            if ros_name(name) not in given]

    def _check(self, parameters):
        values = {parameter.name: parameter.value for parameter in parameters}
        try:
            if 'profile' in values:
                NODE_PARAMETERS[0].checked(values['profile'])
            self._changed_config(self.config, values)
        except ValueError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _apply(self, parameters):
        values = {parameter.name: parameter.value for parameter in parameters}
        self._profile = values.get('profile', self._profile)
        config = self._changed_config(self.config, values)
        if config != self.config:
            self.config = config
            self._on_change(config)
        self._on_ignored([name for name in IGNORED_PARAMETERS if values.get(name) is not None])
