# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Read the YAML file of several rigs; config/rigs.yaml is an example of it."""
import os
from pathlib import Path
import re
from reprlib import repr as shown     # which ends: values may be long, and deep

from fuzzy_stereo_ros.node.launching import camera_remappings, existing, NODE_ROWS, RigNode
from fuzzy_stereo_ros.pairs.yaml_texts import BadYaml, read_yaml
from fuzzy_stereo_ros.parameters.table import IGNORED_PARAMETERS, nearest
from fuzzy_stereo_ros.saved_pairs.format_versions import check_format, RIGS

TOP_KEYS = {'one_process': bool, 'rigs': dict, 'version': int}
RIG_KEYS = {'namespace': str, 'node_name': str, 'left_namespace': str, 'right_namespace': str,
            'params_file': str, 'parameters': dict, 'remappings': dict}
CALLED = {bool: 'true or false', dict: 'maps', int: 'whole numbers', str: 'texts'}
WORD = r'[A-Za-z_][A-Za-z0-9_]*'
NAMES = {'node_name': WORD, **dict.fromkeys(
    ('namespace', 'left_namespace', 'right_namespace'), f'/|/?{WORD}(/{WORD})*')}
OF_EVERY_NODE = ('qos_overrides.', 'start_type_description_service')


def read_rigs(path):
    """
    Return (one_process, list of `RigNode`) of a YAML file.

    Raises ValueError with one sentence that names the file for what cannot be read or is not
    allowed.
    """
    try:
        return _read(Path(path).resolve())
    except (OSError, UnicodeDecodeError, BadYaml) as error:
        reason = ' '.join(str(error).split())
        raise ValueError(f'the file of rigs {path} cannot be read: {reason}') from None
    except ValueError as error:
        raise ValueError(f'the file of rigs {path}: {error}') from None


def _read(path):
    content = read_yaml(path.read_text(encoding='utf-8'))
    if isinstance(content, dict):
        check_format('it', content.get('version', RIGS), RIGS)
    content = _checked('the file', content, TOP_KEYS)
    if not content.get('rigs'):
        raise ValueError("there are no rigs; give 'rigs:' with a map from names to rigs")
    rigs, places = [], {}
    for name, values in content['rigs'].items():
        who = f"rig '{name}'"
        rig = _rig(who, str(name), _checked(who, values or {}, RIG_KEYS), path.parent)
        place = (rig.namespace.strip('/'), rig.node_name)
        if place in places:
            raise ValueError(f'{who} has the namespace and node_name of {places[place]}; '
                             'give it another of one of them')
        places[place] = who
        rigs.append(rig)
    return content.get('one_process', False), rigs


def _rig(who, name, values, folder):
    values = {'namespace': name, 'node_name': 'disparity_node', 'left_namespace': 'left',
              'right_namespace': 'right', **values}
    for key, allowed in NAMES.items():
        if not re.fullmatch(allowed, values[key]):
            slashes = '' if key == 'node_name' else ', parted by /'
            raise ValueError(f'{who}: {key} is {shown(values[key])}; allowed are letters, digits '
                             f'and _, beginning with no digit{slashes}')
    params_file = values.get('params_file', '')
    if params_file:
        params_file = str(folder / os.path.expanduser(params_file))
    try:
        parameters = _parameters(values.get('parameters', {}))
        existing(params_file)
    except ValueError as error:
        raise ValueError(f'{who}: {error}') from None
    remappings = [
        *_remappings(who, values.get('remappings', {})),
        *camera_remappings(values['left_namespace'], values['right_namespace'])]
    return RigNode(
        values['namespace'], values['node_name'], remappings, params_file, parameters)


def _checked(who, values, keys):
    """Return a map whose keys are known and whose values are of their types; ValueError else."""
    if not isinstance(values, dict):
        raise ValueError(f'{who} is {shown(values)}; allowed are maps with {", ".join(keys)}')
    for key, value in values.items():
        if key not in keys:
            raise ValueError(f'{who} has the key {shown(key)}; allowed are {", ".join(keys)}')
        if not isinstance(value, keys[key]):
            raise ValueError(f'{who}: {key} is {shown(value)}; allowed are {CALLED[keys[key]]}')
    return values


def _remappings(who, values):
    for name, other in values.items():
        if not (isinstance(name, str) and isinstance(other, str) and name and other):
            raise ValueError(f'{who}: remappings has {shown(name)}: {shown(other)}; '
                             'allowed are names of topics')
    return values.items()


def _parameters(values):
    rows = {row.name: row for row in NODE_ROWS}
    parameters = dict(_flat(values))
    for name, value in parameters.items():
        if name in rows:
            parameters[name] = rows[name].checked(value)
        elif name not in IGNORED_PARAMETERS and not name.startswith(OF_EVERY_NODE):
            raise ValueError(f"parameters has '{name}'{nearest(name)}, and no parameter of the "
                             'node is called so; config/fuzzy_stereo.yaml lists them')
    return parameters


def _flat(values, before=''):
    """Yield (name, value) of nested maps, names joined by dots as ROS does."""
    for name, value in values.items():
        if isinstance(value, dict):
            yield from _flat(value, f'{before}{name}.')
        else:
            yield f'{before}{name}', value
