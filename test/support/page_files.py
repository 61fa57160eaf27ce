# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The files that the commands of the pages read."""
import cv2
from fuzzy_stereo_ros.pairs.camera_files import (
    centred_calibration, rectified_cameras, write_camera)
from fuzzy_stereo_ros.pairs.disparity_files import write_disparity
from fuzzy_stereo_ros.pairs.image_files import write_image
from fuzzy_stereo_ros.saved_pair import write_saved_pair
from fuzzy_stereo_ros.synthetic.scenes import make_pair
from fuzzy_stereo_ros.views.video import VideoFile
import numpy as np
import pytest
from saved_scene import running
import written_scenes


def fill(folder):
    """Put what the pages' commands read into a folder."""
    made_bags = pytest.importorskip('made_bags', reason='rosbags is not installed')
    pair = make_pair(48, 100, 64)
    write_image(folder / 'left.png', pair.left)
    write_image(folder / 'right.png', pair.right)
    write_disparity(folder / 'disparity.pfm', pair.truth)
    write_saved_pair(folder / 'report', running()[2])
    pairs = made_bags.scene(2, columns=100)
    made_bags.write_bag(folder / 'recorded', pairs=pairs)
    made_bags.write_bag(folder / 'recorded.bag', 'ros1', pairs)
    made_bags.write_bag(folder / 'images_only', pairs=pairs, infos=False)
    for side in ('left', 'right'):
        images = [getattr(one, side) for one in pairs]
        video = VideoFile(folder / f'{side}.mp4', 10.0)
        for number, image in enumerate(images):
            video.write(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR) if image.ndim == 2 else image)
            for place in (side, f'{side}_folder'):
                (folder / place).mkdir(exist_ok=True)
                write_image(folder / place / f'{number}.png', image)
        video.close()
    calibration = centred_calibration(63.0, 0.12, 0.0, 48, 100)
    for side, camera in rectified_cameras(calibration, 48, 100).items():
        write_camera(folder / f'{side}.yaml', camera, side)
    raw = cv2.FileStorage(str(folder / 'stereo.yml'), cv2.FILE_STORAGE_WRITE)
    camera = np.array([[63.0, 0, 49.5], [0, 63, 23.5], [0, 0, 1]])
    for name, value in (('K1', camera), ('K2', camera), ('D1', np.zeros(5)), ('D2', np.zeros(5)),
                        ('R', np.eye(3)), ('T', np.array([-0.12, 0, 0]))):
        raw.write(name, value)
    raw.release()
    scene = written_scenes.pair()
    written_scenes.write_named(folder / 'datasets' / 'scene', scene)
    (folder / 'results').mkdir()
    write_disparity(folder / 'results' / 'scene.pfm', scene.truth)
