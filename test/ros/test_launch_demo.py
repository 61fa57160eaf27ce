# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The demo with the real launch: what comes out is the ground truth of the made scene."""
from fuzzy_stereo_ros.synthetic.scenes import made_sequence
import launched
from launched import launch_testing
from node_process import values_of
import numpy as np
import pytest

ROWS, COLUMNS, DISPARITIES = 120, 160, 16


@pytest.mark.launch_test
def generate_test_description():
    return launched.description(launched.included(
        'demo.launch.py', rows=str(ROWS), columns=str(COLUMNS), disparities=str(DISPARITIES),
        rate='10', viewer='False'))


class TestTheDemo(launched.Launched):
    rig = {'cli_args': ['--ros-args', '-r', '__ns:=/unused']}

    def test_the_preview_that_the_viewer_shows_is_a_picture_in_colour(self):
        from sensor_msgs.msg import Image
        pictures = {}
        self.around.collect(Image, '/preview', pictures)
        picture = next(iter(self.around.until(lambda: pictures, 'a preview').values()))
        assert (picture.height, picture.width, picture.encoding) == (ROWS, COLUMNS, 'bgr8')
        assert np.std(np.frombuffer(picture.data, np.uint8)) > 20

    def test_the_disparities_are_those_of_a_frame_of_the_scene(self):
        self.around.listen()
        found = self.around.until(lambda: self.around.disparities, 'a disparity image')
        message = next(iter(found.values()))
        assert message.max_disparity == DISPARITIES - 1
        values = values_of(message.image)
        assert values.shape == (ROWS, COLUMNS)
        valid = values >= message.min_disparity
        assert valid.mean() > 0.7
        frames = made_sequence(ROWS, COLUMNS, DISPARITIES, 12, pan=2.0)
        assert max(np.mean(np.abs(values - frame.truth)[valid] < 0.5) for frame in frames) > 0.9


@launch_testing.post_shutdown_test()
class TestTheEnd(launched.Ended):
    pass
