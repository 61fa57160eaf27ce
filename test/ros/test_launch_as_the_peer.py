# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""stereo_image_proc's own launch test, with this package's executable in the place of its own."""
from pathlib import Path
import sys
import tempfile
import unittest

import launched
from launched import launch_ros, launch_testing, SHIFT
from node_process import shifted_pair, SOON, values_of
import numpy as np
import pytest
from real_pairs import DATA
from repository import ROOT

ALOE = DATA / 'midd2006_third' / 'Aloe'
# As there, the names with which its topics are not called any more among them.
OVERRIDES = {f'/{side}/image_rect{ending}': {'subscription': {'reliability': 'reliable'}}
             for ending in ('', '_color') for side in ('left', 'right')}


def images():
    """Return the paths of a pair: the peer's Aloe, a shifted texture where that is not here."""
    if ALOE.is_dir():
        return [str(ALOE / f'{side}.png') for side in ('left', 'right')]
    from fuzzy_stereo_ros.pairs.image_files import write_image
    folder = Path(launched.held.enter_context(tempfile.TemporaryDirectory()))
    for side, image in zip(('left', 'right'), shifted_pair(SHIFT, rows=370, columns=427)):
        write_image(folder / f'{side}.png', image)
    return [str(folder / f'{side}.png') for side in ('left', 'right')]


@pytest.mark.launch_test
def generate_test_description():
    from fuzzy_stereo_ros.node.launching import program
    publisher = ROOT / 'test' / 'support' / 'stereo_image_publisher.py'
    return launched.description(
        launch_ros.Node(executable=sys.executable, arguments=[str(publisher), *images()],
                        output='screen'),
        launch_ros.Node(**program('disparity_node'), name='disparity_node', output='screen',
                        parameters=[{'qos_overrides': OVERRIDES}]))


class TestDisparityNode(unittest.TestCase):

    def test_a_disparity_arrives_within_a_minute(self, proc_output):
        from stereo_msgs.msg import DisparityImage
        with launched.surroundings() as around:
            messages = {}
            around.collect(DisparityImage, 'disparity', messages, 1)
            around.until(lambda: messages, 'a disparity', timeout=SOON)
        message = next(iter(messages.values()))
        assert (message.f, message.t) == (1.0, 0.0)
        assert np.mean(values_of(message.image) >= message.min_disparity) > 0.7
        text = b''.join(event.text for event in proc_output).decode()
        assert text.count('disparities are without metres (t is 0)') == 1
        assert 'refused' not in text
        assert text.count('no topic of this node has these QoS') == 1


@launch_testing.post_shutdown_test()
class TestTheEnd(launched.Ended):
    pass
