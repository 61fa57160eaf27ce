# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The table of parameters; the ROS parameters, options, YAML, launch arguments and docs follow it.

Rows of the matcher are made from the fields of `MatcherConfig`, which checks them; the node's own
rows are here. Names and defaults are those of stereo_image_proc if it has the parameter.
"""
from dataclasses import replace
from difflib import get_close_matches

from fuzzy_stereo_ros.matching.config import Parameter, PROFILES, ROWS
from fuzzy_stereo_ros.pairs.pair_reader import SCALES

ROS_NAMES = {'disparities': 'disparity_range'}      # of fields with another name in MatcherConfig
OUTPUTS = ('disparity', 'confidence', 'depth', 'depth_compressed', 'points2', 'preview',
           'preview_compressed')
NODE_PARAMETERS = (
    Parameter('profile', 'realtime', 'preset of the matcher; single parameters override it',
              choices=tuple(PROFILES)),
    Parameter('image_transport', 'raw', 'how both images come in',
              choices=('raw', 'compressed'), read_only=True),
    Parameter('queue_size', 5,
              'messages of a topic that may wait for the other topics; at least 2 with '
              'approximate_sync', 1, 1_000_000, read_only=True),
    Parameter('approximate_sync', False,
              'match messages with the nearest stamps, not only with equal ones; a pair then '
              'waits until the next message shows that it is the nearest', read_only=True),
    Parameter('approximate_sync_tolerance_seconds', 0.0,
              'with approximate_sync: largest difference of two stamps; 0 is no limit',
              0.0, 3600.0, 's', read_only=True),
    Parameter('cache_camera_info', False,
              'use the newest camera_info of each camera whatever its stamp: for calibrations '
              'that do not change and are published once or seldom', read_only=True),
    Parameter('input_qos', 'sensor_data',
              'QoS of the subscriptions: best effort and depth 5, reliable and depth 5, what the '
              'publishers offer (also later ones), or the default of the middleware; '
              'qos_overrides change single policies',
              choices=('sensor_data', 'reliable', 'best_available', 'system_default'),
              read_only=True),
    Parameter('use_system_default_qos', False,
              'the same as input_qos system_default', read_only=True),
    Parameter('output_qos', 'reliable',
              'QoS of the publishers: reliable and depth 1, best effort and depth 5, reliable and '
              'transient local, or the default of the middleware',
              choices=('reliable', 'sensor_data', 'latched', 'system_default'), read_only=True),
    Parameter('rectify', False,
              'rectify raw images by K, D, R and P of camera_info', read_only=True),
    Parameter('crop', False,
              'match only the rectangle in which both rectified images have pixels, by K, D, R '
              'and P of camera_info', read_only=True),
    Parameter('scale', 1.0,
              'scale of the images before matching; outputs have their size and focal length, '
              'parameters in px refer to the full image', choices=SCALES, read_only=True),
    Parameter('outputs', ' '.join(OUTPUTS),
              'advertised outputs; an output without a subscriber costs nothing',
              choices=OUTPUTS, several=True, read_only=True),
    Parameter('depth_encoding', '32FC1',
              'of depth/image_rect: metres, NaN is invalid; or millimetres, 0 is invalid',
              choices=('32FC1', '16UC1'), read_only=True),
    Parameter('use_color', True, 'points2 has colours', read_only=True),
    Parameter('avoid_point_cloud_padding', True,
              'points2 has no padding, which halves message size and latency; false is the '
              'default of stereo_image_proc', read_only=True),
    Parameter('points_stride', 1,
              'step of rows and columns between the points of points2', 1, 64, read_only=True),
    Parameter('points_max_depth', -1.0,
              'points2, and files of points, leave out points that are farther away; 0 is no '
              'limit, -1 a third of focal length (px) times baseline: farther away one pixel of '
              'disparity is more than a third of the depth', -1.0, 1e6, 'm', read_only=True),
    Parameter('points_voxel_size', 0.0,
              'points2 is a list with one point of each cube of this size; 0 is a point for each '
              'pixel, in rows and columns', 0.0, 1e3, 'm', read_only=True),
    Parameter('save_directory', '~/.ros/fuzzy_stereo_ros',
              'folder in which the service ~/save makes a folder for each call', read_only=True),
    Parameter('max_saved_pairs', 100,
              'saved pairs in save_directory from which on ~/save rejects further ones, so that '
              'it does not fill the disk', 1, 1_000_000, read_only=True),
    Parameter('no_pair_seconds', 5.0,
              'time without a pair after which the node reports what is missing',
              0.1, 3600.0, 's', read_only=True),
)


def ros_name(field_name):
    """Return the ROS parameter's name of a field of MatcherConfig."""
    return ROS_NAMES.get(field_name, field_name)


MATCHER_PARAMETERS = tuple(replace(row, name=ros_name(row.field)) for row in ROWS)
ROS_PARAMETERS = (
    *NODE_PARAMETERS, *(row for row in MATCHER_PARAMETERS if row.field != 'reference'))
# Of stereo_image_proc's matchers; launch files and parameter files that set them still work.
IGNORED_PARAMETERS = (
    'P1', 'P2', 'correlation_window_size', 'disp12_max_diff', 'full_dp', 'prefilter_cap',
    'prefilter_size', 'sgbm_mode', 'stereo_algorithm', 'texture_threshold', 'uniqueness_ratio')


def sync_tolerance(settings):
    """Return the tolerance of a Synchroniser, ns, None for equal stamps; settings: by name."""
    if not settings['approximate_sync']:
        return None
    return round(settings['approximate_sync_tolerance_seconds'] * 1e9)


def nearest(name, names=(), likeness=0.6):
    """Return ' (did you mean X?)' of the names, () = the table's, or '' if none is similar."""
    if not names and name in ROS_NAMES:
        near = [ROS_NAMES[name]]
    else:
        near = get_close_matches(
            name, names or [row.name for row in ROS_PARAMETERS], 1, likeness)
    return ''.join(f' (did you mean {one}?)' for one in near)


def in_ros_words(sentence):
    """Return a sentence that begins with a field of MatcherConfig with the ROS name instead."""
    name, rest = sentence.split(' ', 1) if ' ' in sentence else (sentence, '')
    return f'{ROS_NAMES[name]} {rest}' if name in ROS_NAMES else sentence
