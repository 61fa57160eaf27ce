# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The blocks of docs/from_stereo_image_proc.md, which tests start."""
import ast
import re

from repository import ROOT

PAGE = (ROOT / 'docs' / 'from_stereo_image_proc.md').read_text(
    encoding='utf-8')
CAMERAS = [word for side in ('left', 'right') for topic in ('image_rect', 'camera_info')
           for word in ('-r', f'{side}/{topic}:=/camera/{side}/{topic}')]


def block(language):
    """Return the first block of a language."""
    return re.search(f'```{language}\n(.*?)```', PAGE, re.DOTALL)[1]


def arguments_of_launched_node():
    """Return the node's command line as launch makes it of the page's launch file."""
    calls = [node for node in ast.walk(ast.parse(block('python')))
             if isinstance(node, ast.Call) and getattr(node.func, 'id', '') == 'Node']
    options = {word.arg: ast.literal_eval(word.value) for word in calls[0].keywords}
    assert (options['package'], options['executable']) == ('fuzzy_stereo_ros', 'disparity_node')
    rules = [('__ns', f"/{options['namespace']}"), ('__node', options['name']),
             *options['remappings']]
    return ['--ros-args', *(word for name, value in rules for word in ('-r', f'{name}:={value}')),
            *(word for name, value in options['parameters'][0].items()
              for word in ('-p', f'{name}:={str(value).lower()}'))]
