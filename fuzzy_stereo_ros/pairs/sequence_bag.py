# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A sequence of rectified pairs as a ROS 2 bag (mcap), written with rosbags."""
from fuzzy_stereo_ros.pairs.camera_files import rectified_cameras
import numpy as np

ENCODINGS = {(2, 1): 'mono8', (2, 2): 'mono16', (3, 1): 'bgr8', (3, 2): 'bgr16'}
FRAME = 'left_camera_optical_frame'
START = 1_700_000_000_000_000_000   # ns, the first stamp: any will do, but 0, which is no stamp
BAG_VERSION = 9     # of metadata.yaml, that of Jazzy


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
    try:
        from rosbags.rosbag2 import StoragePlugin, Writer
        from rosbags.typesys import get_typestore, Stores
    except ImportError:
        raise ValueError('there is no rosbags, which writes bags: '
                         "pip install 'fuzzy_stereo_ros[bags]'") from None

    store = get_typestore(Stores.ROS2_JAZZY)
    types = store.types
    with Writer(path, version=BAG_VERSION, storage_plugin=StoragePlugin.MCAP) as bag:
        topics = {
            (side, name): bag.add_connection(f'/{side}/{name}', f'sensor_msgs/msg/{kind}',
                                             typestore=store)
            for side in ('left', 'right')
            for name, kind in (('image_rect', 'Image'), ('camera_info', 'CameraInfo'))}
        for number, images in enumerate(pairs):
            stamp = START + round(number * 1e9 / rate)
            header = _header(types, stamp)
            cameras = rectified_cameras(calibration, *images[0].shape[:2])
            for (side, camera), image in zip(cameras.items(), images):
                for name, message in (('image_rect', _image(types, header, image)),
                                      ('camera_info', _info(types, header, camera))):
                    topic = topics[side, name]
                    bag.write(topic, stamp, store.serialize_cdr(message, topic.msgtype))


def _header(types, stamp):
    seconds, nanoseconds = divmod(stamp, 1_000_000_000)
    return types['std_msgs/msg/Header'](
        stamp=types['builtin_interfaces/msg/Time'](sec=seconds, nanosec=nanoseconds),
        frame_id=FRAME)


def _image(types, header, image):
    image = np.ascontiguousarray(image, image.dtype.newbyteorder('<'))
    return types['sensor_msgs/msg/Image'](
        header=header, height=image.shape[0], width=image.shape[1], encoding=encoding_of(image),
        is_bigendian=0, step=image.strides[0], data=image.reshape(-1).view(np.uint8))


def _info(types, header, camera):
    region = types['sensor_msgs/msg/RegionOfInterest'](**vars(camera.roi))
    return types['sensor_msgs/msg/CameraInfo'](
        header=header, roi=region, height=camera.height, width=camera.width,
        distortion_model=camera.distortion_model, binning_x=camera.binning_x,
        binning_y=camera.binning_y, **{name: np.array(getattr(camera, name)) for name in 'dkrp'})
