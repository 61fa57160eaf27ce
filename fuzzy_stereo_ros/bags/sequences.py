# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A sequence of rectified pairs as a ROS 2 bag (mcap)."""
from contextlib import closing

from fuzzy_stereo_ros.bags.writing import BagWriter, Messages, METADATA, read_description
from fuzzy_stereo_ros.pairs.camera_files import rectified_cameras
import numpy as np

ENCODINGS = {(2, 1): 'mono8', (2, 2): 'mono16', (3, 1): 'bgr8', (3, 2): 'bgr16'}
FRAME = 'left_camera_optical_frame'
START = 1_700_000_000_000_000_000   # ns, the first stamp: any will do, but 0, which is no stamp


def encoding_of(image):
    """Return ROS's word for an image, uint8 or uint16, (R, C) or (R, C, 3) BGR."""
    return ENCODINGS[image.ndim, image.itemsize]


def write_sequence_bag(path, pairs, calibration, rate):
    """
    Write pairs to /left and /right, image_rect and camera_info each, with equal stamps.

    path: a folder that does not exist yet. pairs: iterable of (left, right), each uint8 or
    uint16, (R, C) or (R, C, 3) BGR. calibration: the Calibration of all. rate: pairs a second.
    Needs rosbags: ValueError without it. Raises OSError where it cannot be written.
    """
    messages = Messages()
    with closing(BagWriter(path)) as bag:
        for number, images in enumerate(pairs):
            stamp = START + round(number * 1e9 / rate)
            cameras = rectified_cameras(calibration, *images[0].shape[:2])
            for (side, camera), image in zip(cameras.items(), images):
                for topic, kind, values in (
                        (f'/{side}/image_rect', 'sensor_msgs/msg/Image', _image(image)),
                        (f'/{side}/camera_info', 'sensor_msgs/msg/CameraInfo', _info(camera))):
                    message = messages.make(kind, **values)
                    header = message.header
                    header.stamp.sec, header.stamp.nanosec = divmod(stamp, 1_000_000_000)
                    header.frame_id = FRAME
                    bag.write(topic, kind, messages.typestore, messages.content(message), stamp)


def is_sequence_bag(folder):
    """Return whether a folder (Path) holds a bag of `write_sequence_bag`, and nothing else."""
    try:
        described = read_description(folder)
        return (described['starting_time'] == {'nanoseconds_since_epoch': START}
                and {entry.name for entry in folder.iterdir()}
                == {METADATA, *described['relative_file_paths']})
    except (OSError, ValueError, TypeError):
        return False


def _image(image):
    """Return the fields of a sensor_msgs/Image."""
    image = np.ascontiguousarray(image, image.dtype.newbyteorder('<'))
    return {'height': image.shape[0], 'width': image.shape[1], 'encoding': encoding_of(image),
            'step': image.strides[0], 'data': image.reshape(-1).view(np.uint8)}


def _info(camera):
    """Return the fields of a sensor_msgs/CameraInfo."""
    return {**vars(camera), **{name: np.array(getattr(camera, name)) for name in 'dkrp'}}
