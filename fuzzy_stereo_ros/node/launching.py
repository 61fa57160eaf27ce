# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Functions of the launch files: arguments from the table of parameters, and nodes of rigs."""
from contextlib import suppress
from dataclasses import dataclass, field
import os
from pathlib import Path
from reprlib import repr as shortened
import sys

from ament_index_python.packages import get_package_prefix, PackageNotFoundError
from fuzzy_stereo_ros.node.subscriptions import FAST_DDS_VARIABLES, has_fast_dds_profile
from fuzzy_stereo_ros.pairs.camera_files import read_yaml
from fuzzy_stereo_ros.parameters.table import IGNORED_PARAMETERS, Parameter, ROS_PARAMETERS
from launch.actions import DeclareLaunchArgument, SetEnvironmentVariable
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
import yaml

PACKAGE = 'fuzzy_stereo_ros'
MODULES = {'disparity_node': f'{PACKAGE}.node.disparity_node',
           'managed_disparity_node': f'{PACKAGE}.node.managed_node',
           'simulated_cameras': f'{PACKAGE}.node.simulated_cameras'}
TRUTH = {'true': True, '1': True, 'false': False, '0': False}
NODE_ROWS = (*ROS_PARAMETERS, Parameter('use_sim_time', False, 'take the time from /clock'))
PROCESS_ROWS = (
    Parameter('output', 'screen', 'destination of what the node prints',
              choices=('screen', 'log', 'both', 'own_log', 'full')),
    Parameter('log_level', 'info', 'lowest level of messages that the node logs',
              choices=('debug', 'info', 'warn', 'error', 'fatal')),
)
RIG_KEYS = {'namespace': str, 'node_name': str, 'left_namespace': str, 'right_namespace': str,
            'params_file': str, 'parameters': dict, 'remappings': dict}


@dataclass(frozen=True)
class RigNode:
    """
    The node of one stereo rig.

    remappings: list of (from, to); the first that fits a topic applies.
    params_file: path, '' for none. parameters: {name: value}, which override the file; launch_ros
    joins nested names.
    """

    namespace: str
    node_name: str
    remappings: list
    params_file: str = ''
    parameters: dict = field(default_factory=dict)


def declared(rows, left_out=''):
    """
    Return a DeclareLaunchArgument for each row of a table.

    left_out: meaning of an empty argument, which is then the default; '' = the row's default is.
    """
    return [DeclareLaunchArgument(
        row.name, default_value='' if left_out else str(row.default),
        description=row.described() + (left_out and f'; empty: {left_out}')) for row in rows]


def ignored_arguments():
    """Return a DeclareLaunchArgument for each ignored parameter of stereo_image_proc."""
    return [DeclareLaunchArgument(name, default_value='',
                                  description="of stereo_image_proc's matchers; ignored")
            for name in IGNORED_PARAMETERS]


def argument(context, row):
    """Return the value of a row's launch argument; ValueError if it is not allowed."""
    value = LaunchConfiguration(row.name).perform(context)
    if isinstance(row.default, bool):
        return row.checked(TRUTH.get(value.lower(), value))
    with suppress(ValueError):      # `checked` rejects it
        value = type(row.default)(value)
    return row.checked(value)


def arguments(context, rows):
    """Return {name: value} of the rows' launch arguments; ValueError if one is not allowed."""
    return {row.name: argument(context, row) for row in rows}


def given_parameters(context):
    """Return {name: value} of the node's parameters whose launch arguments are not empty."""
    texts = {name: LaunchConfiguration(name).perform(context)
             for name in (*IGNORED_PARAMETERS, *(row.name for row in NODE_ROWS))}
    return {**arguments(context, [row for row in NODE_ROWS if texts[row.name]]),
            **{name: yaml.safe_load(texts[name]) for name in IGNORED_PARAMETERS if texts[name]}}


def camera_remappings(left_namespace, right_namespace, image='image_rect'):
    """Return the remappings of the four inputs to two cameras; image: name of their topic."""
    return [(f'{side}/{topic}', f"{namespace.rstrip('/')}/{name}")
            for side, namespace in (('left', left_namespace), ('right', right_namespace))
            for topic, name in (('image_rect', image), ('camera_info', 'camera_info'))]


def dds_profile(share):
    """Return the actions that set our profile of Fast DDS; none if the user has set one."""
    if has_fast_dds_profile():
        return []
    return [SetEnvironmentVariable(FAST_DDS_VARIABLES[0], str(share / 'config' / 'fastdds.xml'))]


def installed(package):
    """Return whether ROS finds a package."""
    try:
        get_package_prefix(package)
    except (PackageNotFoundError, OSError):     # OSError without AMENT_PREFIX_PATH
        return False
    return True


def program(executable, *words):
    """Return the arguments of a launch_ros Node that runs one of our executables with words."""
    if installed(PACKAGE):
        return {'package': PACKAGE, 'executable': executable, 'arguments': list(words)}
    # The package is not installed, only on Python's path.
    return {'executable': sys.executable, 'arguments': ['-m', MODULES[executable], *words]}


def process_of(rig, output, log_level, managed=False):
    """
    Return the Node action of a RigNode; ValueError if its params_file does not exist.

    managed: whether the node has a life cycle.
    """
    executable = 'managed_disparity_node' if managed else 'disparity_node'
    parameters = {name: ParameterValue(value, value_type=str) if isinstance(value, str) else value
                  for name, value in rig.parameters.items()}
    return Node(
        **program(executable, '--ros-args', '--log-level', log_level), output=output,
        name=rig.node_name, namespace=rig.namespace, remappings=rig.remappings,
        parameters=[*filter(None, [existing(rig.params_file), parameters])])


def existing(params_file):
    """Return the path of a parameter file, '' for none; ValueError if it does not exist."""
    if params_file and not os.path.isfile(params_file):
        raise ValueError(f"params_file is '{params_file}', which is no file; give the path of a "
                         'file of parameters, or nothing for the defaults')
    return params_file


def read_rigs(path):
    """
    Return the list of `RigNode` of a YAML file such as config/rigs.yaml.

    Raises ValueError, one sentence that names the file, if it cannot be read or has an entry that
    is not allowed.
    """
    path = Path(path).resolve()
    try:
        content = _map('the file', read_yaml(path.read_text(encoding='utf-8')), {'rigs': dict})
        rigs = [_rig(f"rig '{name}'", str(name), values or {}, path.parent)
                for name, values in content.get('rigs', {}).items()]
        if not rigs:
            raise ValueError("there are no rigs; give 'rigs:' with a map from names to rigs")
        places = [(rig.namespace.strip('/'), rig.node_name) for rig in rigs]
        if len(set(places)) < len(places):
            raise ValueError('two rigs have one namespace and node_name; give each its own')
    except (OSError, ValueError) as error:
        reason = ' '.join(str(error).split())
        raise ValueError(f'the file of rigs {path}: {reason}') from None
    return rigs


def _rig(who, name, values, folder):
    """Return a RigNode; the node itself checks names of topics, and parameters."""
    values = {'namespace': name, 'node_name': 'disparity_node', 'left_namespace': 'left',
              'right_namespace': 'right', 'params_file': '', 'parameters': {}, 'remappings': {},
              **_map(who, values, RIG_KEYS)}
    params_file = values['params_file'] and str(folder / os.path.expanduser(values['params_file']))
    _map(f'{who}: remappings', values['remappings'], dict.fromkeys(values['remappings'], str))
    try:
        existing(params_file)
    except ValueError as error:
        raise ValueError(f'{who}: {error}') from None
    remappings = [*values['remappings'].items(),
                  *camera_remappings(values['left_namespace'], values['right_namespace'])]
    return RigNode(values['namespace'], values['node_name'], remappings, params_file,
                   values['parameters'])


def _map(who, values, kinds):
    """Return a map; ValueError if a key is not one of kinds, or its value of another type."""
    if not isinstance(values, dict):
        raise ValueError(f'{who} is {shortened(values)}; allowed are maps with {", ".join(kinds)}')
    for key, value in values.items():
        if key not in kinds:
            raise ValueError(f'{who} has the key {shortened(key)}; allowed are {", ".join(kinds)}')
        if not isinstance(value, kinds[key]):
            allowed = {str: 'texts', dict: 'maps'}[kinds[key]]
            raise ValueError(f'{who}: {key} is {shortened(value)}; allowed are {allowed}')
    return values
