# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The files made of the table of parameters: docs/parameters.md and config/fuzzy_stereo.yaml.

`python -m fuzzy_stereo_ros.parameters.page docs/parameters.md config/fuzzy_stereo.yaml` renews
them; in the page what stands between two marks.
"""
from pathlib import Path
import re
import sys
import textwrap

from fuzzy_stereo_ros.matching import MatcherConfig, PROFILES
from fuzzy_stereo_ros.pairs.image_files import write_whole
from fuzzy_stereo_ros.parameters.table import (
    MATCHER_PARAMETERS, NODE_PARAMETERS, ROS_PARAMETERS, written)

BEGIN, END = '<!-- parameters: begin -->', '<!-- parameters: end -->'


def parameter_page():
    """Return the two tables as Markdown: the matcher's parameters, and what the node adds."""
    configs = {name: MatcherConfig.from_profile(name) for name in PROFILES}
    matcher = [('parameter', *configs, 'allowed', 'meaning')]
    for row in MATCHER_PARAMETERS:
        values = [written(getattr(config, row.field)) for config in configs.values()]
        name = f'`{row.field}`'
        if row not in ROS_PARAMETERS:
            name += ' (not in ROS)'
        elif row.name != row.field:
            name += f' (ROS: `{row.name}`)'
        matcher.append((name, *values, row.allowed, row.sentence))
    node = [('parameter', 'default', 'allowed', 'meaning'),
            *((f'`{row.name}`', written(row.default), row.allowed, row.sentence)
              for row in NODE_PARAMETERS)]
    return ('Of the matcher, with the values of the profiles:\n\n' + _markdown(matcher)
            + '\n\nOf the node alone:\n\n' + _markdown(node))


def renewed(text):
    """Return a text with what stands between the two marks replaced by `parameter_page`."""
    found = re.search(f'{BEGIN}\n.*?{END}', text, re.DOTALL)
    if found is None:
        raise ValueError(f'the text has no {BEGIN} ... {END}')
    return f'{text[:found.start()]}{BEGIN}\n{parameter_page()}\n{END}{text[found.end():]}'


def parameter_file():
    """
    Return the text of config/fuzzy_stereo.yaml: every parameter, its sentence and its default.

    What a profile presets is a comment, so that the file leaves it to the profile.
    """
    lines = ['# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers',
             '# SPDX-License-Identifier: Apache-2.0',
             '# Made from the table of parameters; a test holds the two equal.',
             '# A name behind # is preset by the profile; without the # it overrides the profile.',
             '/**:', '  ros__parameters:']
    for row in ROS_PARAMETERS:
        comment = row.described() + ('; fixed at start' if row.read_only else '')
        lines += textwrap.wrap(comment, 99, initial_indent='    # ', subsequent_indent='    # ')
        value = row.default if isinstance(row.default, float) else written(row.default)
        lines.append(f"    {'# ' if row.preset else ''}{row.name}: {value}")
    return '\n'.join(lines) + '\n'


def _markdown(lines):
    rows = [f"| {' | '.join(line)} |" for line in lines]
    return '\n'.join([rows[0], '|' + '---|' * len(lines[0]), *rows[1:]])


if __name__ == '__main__':
    for path in map(Path, sys.argv[1:]):
        content = parameter_file() if path.suffix == '.yaml' else renewed(
            path.read_text(encoding='utf-8'))
        write_whole(path, content.encode())
