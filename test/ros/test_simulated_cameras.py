# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The rig that is not there publishes the scene it is asked for."""
from fuzzy_stereo_ros.pairs.calibration import read_calibration
from fuzzy_stereo_ros.pairs.messages import read_image
from fuzzy_stereo_ros.synthetic.scenes import make_sequence
from node_process import NodeProcess, own_domain
import numpy as np
import pytest

MODULE = 'fuzzy_stereo_ros.node.simulated_cameras'


def test_what_is_published_is_the_scene_of_the_options_seen_by_cameras_of_the_options(ros):
    from ros_bench import Surroundings
    from sensor_msgs.msg import CameraInfo, Image
    with own_domain() as domain:
        around = Surroundings(domain)
        rig = NodeProcess(domain, '--columns=90', '--rows=60', '--disparities=24', '--frames=3',
                          '--seed=5', '--poles=2', '--pan=3', '--noise=1',
                          '--exposure=0.8', '--colour', '--offset=-7', '--reliable',
                          '--rate=20', module=MODULE)
        try:
            topics = [(kind, f'/{side}/{name}') for side in ('left', 'right')
                      for kind, name in ((Image, 'image_rect'), (CameraInfo, 'camera_info'))]
            heard = [{} for _ in topics]
            for (kind, topic), messages in zip(topics, heard):
                around.collect(kind, topic, messages)
            around.until(lambda: len(set.intersection(*map(set, heard))) > 4, 'pairs')
            stamps = set.intersection(*map(set, heard))
            left, left_info, right, right_info = (
                [messages[stamp] for stamp in sorted(stamps)] for messages in heard)
        finally:
            around.close()
            code = rig.finish()
    assert code == 0
    made = make_sequence(60, 90, 24, 3, 5, poles=2, pan=3.0, noise=1.0, exposure=0.8,
                         colour=True)
    known = {(pair.left.tobytes(), pair.right.tobytes()) for pair in made}
    published = {tuple(np.ascontiguousarray(read_image(image)).tobytes() for image in pair)
                 for pair in zip(left, right)}
    assert len(published) > 1
    assert published <= known
    calibration = read_calibration(left_info[0], right_info[0])
    assert calibration.offset == -7
    assert calibration.baseline == pytest.approx(0.12)
    assert calibration.focal == pytest.approx(81)
    assert calibration.left.cx == 44.5 and calibration.remarks == ()
