# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The tables of docs/parameters.md, made from the declaration.

`python -m fuzzy_stereo_ros.parameters.page docs/parameters.md` renews them between their marks.
"""
from dataclasses import fields
from pathlib import Path
import re
import sys

from fuzzy_stereo_ros.matching import MatcherConfig, PROFILES
from fuzzy_stereo_ros.pairs.whole_files import write_whole
from fuzzy_stereo_ros.parameters.matcher_options import written_value
from fuzzy_stereo_ros.parameters.table import field_names, listed, NODE_PARAMETERS, ros_name

BEGIN, END = '<!-- parameters: begin -->', '<!-- parameters: end -->'


def parameter_page():
    """Return the two tables as Markdown: the matcher's parameters, and what the node adds."""
    configs = {name: MatcherConfig.from_profile(name) for name in PROFILES}
    matcher = [('parameter', *configs, 'allowed', 'meaning')]
    for field in fields(MatcherConfig):
        values = [_value(getattr(config, field.name)) for config in configs.values()]
        matcher.append((_name(field), *values, _allowed(**field.metadata),
                        field.metadata['sentence']))
    node = [('parameter', 'default', 'allowed', 'meaning')]
    node += [(f'`{row.name}`', _value(row.default),
              _allowed(row.low, row.high, row.unit, row.choices), row.sentence)
             for row in NODE_PARAMETERS]
    return ('Of the matcher, with the values of the profiles:\n\n' + _markdown(matcher)
            + '\n\nOf the node alone:\n\n' + _markdown(node))


def renewed(text):
    """Return a text with what stands between the two marks replaced by `parameter_page`."""
    found = re.search(f'{BEGIN}\n.*?{END}', text, re.DOTALL)
    if found is None:
        raise ValueError(f'the text has no {BEGIN} ... {END}')
    return f'{text[:found.start()]}{BEGIN}\n{parameter_page()}\n{END}{text[found.end():]}'


def _name(field):
    """Return what a parameter is called, and in ROS where that differs."""
    if field.name not in field_names().values():
        return f'`{field.name}` (not in ROS)'
    ros = ros_name(field.name)
    return f'`{field.name}`' if ros == field.name else f'`{field.name}` (ROS: `{ros}`)'


def _value(value):
    return str(value).lower() if isinstance(value, bool) else written_value(value)


def _allowed(low=None, high=None, unit='', choices=(), sentence=''):
    if choices:
        return listed(choices)
    return '' if low is None else f'{written_value(low)} to {written_value(high)} {unit}'.rstrip()


def _markdown(lines):
    written = [f"| {' | '.join(line)} |" for line in lines]
    return '\n'.join([written[0], '|' + '---|' * len(lines[0]), *written[1:]])


if __name__ == '__main__':
    for page in map(Path, sys.argv[1:]):
        write_whole(page, renewed(page.read_text(encoding='utf-8')).encode())
