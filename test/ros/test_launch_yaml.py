# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A launch file in YAML that includes ours and one that starts the executable."""
import launched
from launched import FOLDER, launch_testing
import pytest

pytest.importorskip('launch_yaml', reason='launch_yaml is not importable: it comes with ROS 2')
YAML = """launch:
- arg: {{name: disparities, default: '16'}}
- include:
    file: {file}
    arg:
    - {{name: namespace, value: included}}
    - {{name: node_name, value: stereo}}
    - {{name: left_namespace, value: /left}}
    - {{name: right_namespace, value: /right}}
    - {{name: disparity_range, value: $(var disparities)}}
    - {{name: fill, value: 'true'}}
- node:
    pkg: fuzzy_stereo_ros
    exec: disparity_node
    namespace: plain
    param:
    - {{name: disparity_range, value: $(var disparities)}}
    - {{name: fill, value: true}}
    remap:
    - {{from: left/image_rect, to: /left/image_rect}}
    - {{from: left/camera_info, to: /left/camera_info}}
    - {{from: right/image_rect, to: /right/image_rect}}
    - {{from: right/camera_info, to: /right/camera_info}}
"""


@pytest.mark.launch_test
def generate_test_description():
    file = launched.written('stereo.launch.yaml', YAML.format(
        file=FOLDER / 'fuzzy_stereo.launch.py'))
    return launched.description(launched.included(file))


class TestTheLaunchedNodes(launched.IncludedAndPlain):
    pass


@launch_testing.post_shutdown_test()
class TestTheEnd(launched.Ended):
    pass
