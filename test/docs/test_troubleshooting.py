# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The page of troubles speaks of sentences, parameters and topics that there are."""
import ast
from collections import Counter
from functools import cache
import re
from unittest.mock import Mock

from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.pairs.result_messages import TOPICS
from fuzzy_stereo_ros.pairs.synchroniser import Synchroniser
from fuzzy_stereo_ros.parameters.table import ROS_PARAMETERS
import numpy as np
from pages import in_code_style, ROOT, said, text_of
import pytest

INPUTS = 'image_rect', 'camera_info'
NAME = 'docs/troubleshooting.md'
CODE = [ROOT / name for name in ('fuzzy_stereo_ros', 'launch')]
PARAMETERS = {row.name for row in ROS_PARAMETERS}
# Of ROS, numba and Fast DDS, not of this package.
FOREIGN = {'__pycache__', '~/.cache/fuzzy_stereo_ros', 'image_proc', 'point_cloud_node',
           'image_raw', 'ROS_DOMAIN_ID', 'ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST',
           'valid_window', 'delta_d', 't', 'f', 'f * t / d', 'camera_info', 'false'}


def _text(node):
    """Return the text of a constant or an f-string, None for anything else."""
    if isinstance(node, ast.Constant):
        return node.value if isinstance(node.value, str) else None
    if isinstance(node, ast.JoinedStr):
        return ''.join(part.value if isinstance(part, ast.Constant) else '…'
                       for part in node.values)
    return None


@cache
def texts():
    """Return all texts in the code, in one string, parted by lines."""
    found = []
    for file in (file for folder in CODE for file in folder.rglob('*.py')):
        for node in ast.walk(ast.parse(file.read_text(encoding='utf-8'))):
            text = _text(node)
            if text:
                found.append(' '.join(text.split()))
    return '\n'.join(found)


def missing_parts(sentence):
    """Return the parts of a sentence, parted by …, that stand nowhere in the code."""
    parts = [part.strip() for part in re.split('…', sentence)]
    return [part for part in parts if part and part not in texts()]


@cache
def keys_of_diagnostics():
    """Return the keys under which the node tells figures."""
    sides = [f'{side}/{name}' for side in ('left', 'right') for name in INPUTS]
    diagnostics = pytest.importorskip('fuzzy_stereo_ros.node.diagnostics')
    made, config = diagnostics.Diagnostics(Mock(), 0.0), MatcherConfig(disparities=8)
    image = np.zeros((20, 40), np.uint8)
    made.matched(StereoMatcher(config).match(image, image),
                 **dict.fromkeys(('latency', 'age', 'stamps apart'), 1.0))
    keys = {*diagnostics.counts_of(Synchroniser(sides), Counter(), Counter()), *made.figures(),
            'disparity_range in use', 'change of parameters', 'suspected fault'}
    return {key.split(', ')[0] for key in keys}


@pytest.mark.parametrize('sentence', said(NAME))
def test_a_quoted_sentence_is_one_of_the_code(sentence):
    assert missing_parts(sentence) == []


@pytest.mark.parametrize('words', sorted(set(in_code_style(NAME))))
def test_a_name_in_code_style_is_a_parameter_a_topic_a_file_or_a_text_of_the_code(words):
    topics = {topic for several in TOPICS.values() for topic, _ in several}
    name = words.split(':')[0]
    assert (words in FOREIGN or name in PARAMETERS or words.lstrip('/') in topics
            or words in keys_of_diagnostics()
            or words.startswith(('ros2 ', 'fuzzy-stereo ', 'python -m bench '))
            or (ROOT / words).is_file() or (ROOT / 'launch' / words).is_file()
            or missing_parts(words) == [])


def test_the_table_at_the_top_leads_to_every_section():
    text = text_of(NAME)
    sections = re.findall(r'^## (.+)$', text, re.MULTILINE)
    assert re.findall(r'\[([^]]+)\]\(#', text.split('\n## ')[0]) == sections
