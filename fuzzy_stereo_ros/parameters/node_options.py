# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Options of the command line made from parameters of the node that concern bags too."""
import argparse

from fuzzy_stereo_ros.parameters.matcher_options import option_name, written_value
from fuzzy_stereo_ros.parameters.table import listed, NODE_PARAMETERS

SHORT = {'approximate_sync': '--approximate',
         'approximate_sync_tolerance_seconds': '--tolerance'}


def add_node_options(parser, title, names):
    """Add a group of options for parameters of the node, for node_settings."""
    group = parser.add_argument_group(title, 'as the parameters of the node that are called so')
    for row in _rows(names):
        options = {'default': row.default, 'help': _help(row)}
        if isinstance(row.default, bool):
            options['action'] = argparse.BooleanOptionalAction
        else:
            options.update(type=type(row.default), metavar={int: 'N', float: 'NUMBER'}.get(
                type(row.default), 'WORD'))
        spellings = filter(None, (option_name(row.name), SHORT.get(row.name)))
        group.add_argument(*spellings, dest=row.name, **options)


def node_settings(arguments, names):
    """Return {name: value} of parsed options; ValueError for a value that is not allowed."""
    return {row.name: row.checked(getattr(arguments, row.name)) for row in _rows(names)}


def _rows(names):
    return [row for row in NODE_PARAMETERS if row.name in names]


def _help(row):
    facts = [row.sentence]
    if row.choices:
        facts.append(listed(row.choices))
    elif row.low is not None:
        facts.append(f'{row.low:.10g} to {row.high:.10g} {row.unit}'.rstrip())
    facts.append(f'default: {written_value(row.default)}')
    return '; '.join(facts).replace('%', '%%')
