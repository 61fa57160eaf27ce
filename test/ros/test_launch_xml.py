# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A launch file in XML that includes ours and one that starts the executable."""
import launched
from launched import FOLDER, launch_testing
import pytest

pytest.importorskip('launch_xml', reason='launch_xml is not importable: it comes with ROS 2')
XML = """<launch>
  <arg name="disparities" default="16"/>
  <include file="{file}">
    <arg name="namespace" value="included"/>
    <arg name="node_name" value="stereo"/>
    <arg name="left_namespace" value="/left"/>
    <arg name="right_namespace" value="/right"/>
    <arg name="disparity_range" value="$(var disparities)"/>
    <arg name="fill" value="true"/>
  </include>
  <node pkg="fuzzy_stereo_ros" exec="disparity_node" namespace="plain">
    <param name="disparity_range" value="$(var disparities)"/>
    <param name="fill" value="true"/>
    <remap from="left/image_rect" to="/left/image_rect"/>
    <remap from="left/camera_info" to="/left/camera_info"/>
    <remap from="right/image_rect" to="/right/image_rect"/>
    <remap from="right/camera_info" to="/right/camera_info"/>
  </node>
</launch>
"""


@pytest.mark.launch_test
def generate_test_description():
    file = launched.written('stereo.launch.xml', XML.format(
        file=FOLDER / 'fuzzy_stereo.launch.py'))
    return launched.description(launched.included(file))


class TestTheLaunchedNodes(launched.IncludedAndPlain):
    pass


@launch_testing.post_shutdown_test()
class TestTheEnd(launched.Ended):
    pass
