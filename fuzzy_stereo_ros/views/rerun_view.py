# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Show matched pairs in the Rerun viewer: image, disparity, confidence and points by stamp."""
import math
import os
from pathlib import Path
import sys

import cv2
from fuzzy_stereo_ros.pairs.image_files import check_place, in_eight_bits
import numpy as np

LEAST_DISPARITY = 1.0       # px; points of smaller disparities are too uncertain to show
MOST_POINTS = 100_000       # per frame; of larger images every second, third, ... row and column
POINT_SIZE = 1.5            # in the viewer, px
JPEG_QUALITY = 92


class RerunSink:
    """Shows matched pairs in the viewer, or writes them to a file for it."""

    def __init__(self, path=None):
        """
        Start the viewer, or prepare a file `.rrd`, which is created with the first pair.

        path: None = start the viewer; an existing file is replaced at the end.
        Raises ValueError if rerun-sdk or a display is missing, or the file cannot be written.
        """
        self._path = None if path is None else Path(path)
        if self._path is not None and self._path.suffix != '.rrd':
            raise ValueError(f"{path} has the suffix '{self._path.suffix}'; allowed is .rrd")
        if self._path is not None:
            check_place(self._path)
        try:
            import rerun
        except ImportError:
            raise ValueError('the Rerun viewer needs rerun-sdk, which is not installed (about 170 '
                             'MB): pip install rerun-sdk') from None
        self._rerun, self._stream = rerun, None
        if self._path is None:
            self._begin()

    def add(self, matched, log_time=None):
        """
        Show a MatchedPair at its stamp.

        Points are in the optical frame of the camera of the reference image, in metres.
        Raises OSError if the file cannot be created.
        """
        if self._stream is None:
            self._begin()
        pair, match, config = matched.pair, matched.match, matched.config
        rerun, stream = self._rerun, self._stream
        image = in_eight_bits(getattr(pair, config.reference))
        camera = reference_projection(pair.calibration, config.reference)
        lowest = config.min_disparity
        stream.set_time('stamp', timestamp=np.datetime64(pair.stamp, 'ns'))
        stream.log('rig/camera', rerun.Pinhole(
            focal_length=(camera.fx, camera.fy), principal_point=(camera.cx, camera.cy),
            resolution=image.shape[1::-1]))
        stream.log('rig/camera/image', rerun.EncodedImage(
            contents=cv2.imencode(
                '.jpg', image, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])[1].tobytes(),
            media_type='image/jpeg'))   # raw, a recording would grow by gigabytes
        stream.log('disparity', rerun.DepthImage(
            match.disparity, meter=1.0, colormap='turbo',
            depth_range=(lowest, lowest + config.disparities - 1)))
        stream.log('confidence', rerun.DepthImage(
            match.confidence, meter=1.0, colormap='viridis', depth_range=(0, 1)))
        places, colours = points_of(match.disparity, image, pair.calibration, camera)
        stream.log('rig/points', rerun.Points3D(
            places, colors=colours, radii=rerun.Radius.ui_points(POINT_SIZE)))

    def close(self):
        """
        Finish the file and give it its name, if it has pairs; the viewer stays open.

        Raises OSError if the file is incomplete, and removes it.
        """
        stream, self._stream = self._stream, None
        if stream is None:
            return
        if self._path is None:
            stream.disconnect()     # a flush would wait forever if the user has closed the viewer
            return
        try:
            try:
                stream.flush()
            finally:
                stream.disconnect()
            self._part.replace(self._path)
        except RuntimeError as error:
            raise OSError(f'{self._path} is incomplete and was removed: {error}; is the disk '
                          'full?') from error
        finally:
            self._part.unlink(missing_ok=True)

    def _begin(self):
        """Start a stream into the viewer or into the temporary file."""
        stream = self._rerun.RecordingStream('fuzzy_stereo_ros')
        if self._path is None:
            _start_viewer(stream)
        else:
            self._part = self._path.with_name(f'.{self._path.name}.{os.getpid()}.part')
            try:
                stream.save(self._part, default_blueprint=_blueprint())
            except RuntimeError as error:
                raise OSError(f'{self._path} cannot be created: {error}') from error
        stream.log('rig', self._rerun.ViewCoordinates.RDF, static=True)
        self._stream = stream


def points_of(disparity, image, calibration, camera):
    """
    Return the points of valid pixels, float32 (N, 3), metres, and their colours, uint8 (N, 3) RGB.

    Larger images are subsampled to MOST_POINTS.

    disparity: float32 (R, C), px, NaN = invalid. image: uint8 (R, C) or (R, C, 3) BGR.
    calibration: a Calibration. camera: Projection of the camera that the disparities belong to.
    """
    points = camera.points(calibration.depth(disparity))
    every = math.ceil(math.sqrt(disparity.size / MOST_POINTS))
    there = np.zeros(disparity.shape, bool)
    there[::every, ::every] = (
        disparity[::every, ::every] - np.float32(calibration.offset) >= LEAST_DISPARITY)
    colours = cv2.cvtColor(image, cv2.COLOR_GRAY2RGB if image.ndim == 2 else cv2.COLOR_BGR2RGB)
    return points[there], colours[there]


def reference_projection(calibration, reference):
    """Return the Projection of the camera of the reference image."""
    left = calibration.left
    return left if reference == 'left' else left._replace(cx=left.cx - calibration.offset)


def has_display():
    """Return whether a window can be opened: Linux needs $DISPLAY or $WAYLAND_DISPLAY."""
    return sys.platform != 'linux' or any(
        os.environ.get(name) for name in ('DISPLAY', 'WAYLAND_DISPLAY'))


def _start_viewer(stream):
    """Start the viewer or connect to a running one; raises ValueError with the reason."""
    if not has_display():
        raise ValueError('the Rerun viewer cannot be started: there is no display; write a file '
                         '.rrd and open it on a machine with one: rerun FILE.rrd')
    # Rerun searches PATH for the viewer, which may lack the virtual environment.
    path = os.environ.get('PATH', '')
    os.environ['PATH'] = os.pathsep.join([path, str(Path(sys.executable).parent)])
    try:
        stream.spawn(default_blueprint=_blueprint())
    except RuntimeError as error:
        reason = str(error).splitlines()[0].rstrip('.')
        raise ValueError(f'the Rerun viewer cannot be started: {reason}; or write a file .rrd '
                         'and open it later: rerun FILE.rrd') from error
    finally:
        os.environ['PATH'] = path


def _blueprint():
    """Return the layout of the viewer: points beside image, disparity and confidence."""
    from rerun import blueprint

    return blueprint.Blueprint(blueprint.Horizontal(
        blueprint.Spatial3DView(origin='rig', name='points [m]'),
        blueprint.Vertical(
            blueprint.Spatial2DView(origin='rig/camera', name='image'),
            blueprint.Spatial2DView(origin='disparity', name='disparity [px]'),
            blueprint.Spatial2DView(origin='confidence', name='confidence'))))
