# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Videos by OpenCV's writer: of any frames, and of matched pairs side by side."""
import os
from pathlib import Path

import cv2
from fuzzy_stereo_ros.pairs.whole_files import check_place
from fuzzy_stereo_ros.views.video_frames import letterboxed, side_by_side

CODECS = {'.mp4': 'mp4v', '.avi': 'MJPG'}
RATES = 0.1, 240.0      # frames per second
LARGEST = 4096, 2304    # width and height of a frame in pixels; players and encoders have limits


def check_video(path, rate=RATES[0]):
    """Raise ValueError, with a sentence that says why, where a video cannot be written so."""
    path = Path(path)
    if path.suffix not in CODECS:
        raise ValueError(f"{path} has the suffix '{path.suffix}'; allowed are "
                         f"{', '.join(CODECS)}")
    check_place(path)
    if not RATES[0] <= rate <= RATES[1]:
        raise ValueError(f'the rate of {path} is {rate}; allowed are numbers from {RATES[0]:g} '
                         f'to {RATES[1]:g} frames per second')


class VideoFile:
    """
    A video that is there as a whole, under its name, once it is closed.

    The first frame decides the size, made even and not larger than LARGEST; a later one of
    another size is fitted into it, with dark borders.
    """

    def __init__(self, path, rate):
        """
        Prepare; the file is begun with the first frame. An existing one is replaced at the end.

        path: .mp4 (MPEG-4) or .avi (Motion JPEG). rate: frames per second.
        Raises ValueError for another suffix or rate, and where there is no such folder.
        """
        check_video(path, rate)
        self._path, self._rate = Path(path), float(rate)
        # With a slash in front: what stands before a colon is a protocol to FFmpeg.
        self._part = self._path.absolute().with_name(
            f'.{self._path.stem}.{os.getpid()}.part{self._path.suffix}')
        self._writer, self._size, self._frames = None, None, 0

    def write(self, frame):
        """
        Append a frame: uint8 (R, C, 3) BGR.

        Raises ValueError where this OpenCV cannot encode such a video.
        """
        if self._writer is None:
            self._begin(*frame.shape[:2])
        self._writer.write(letterboxed(frame, *self._size))
        self._frames += 1

    def close(self):
        """
        Finish the file and give it its name; without a frame there is none. Closes once.

        Raises OSError where the file did not become whole, and leaves nothing then.
        """
        writer, self._writer = self._writer, None
        if writer is None:
            return
        writer.release()
        try:
            kept = self._kept()
            if kept < self._frames:
                raise OSError(f'{self._path} could not be written whole, {kept} of '
                              f'{self._frames} frames; is the disk full?')
            self._part.replace(self._path)
        finally:
            self._part.unlink(missing_ok=True)

    def _begin(self, rows, columns):
        """Open the writer for frames of a size; OpenCV says by isOpened whether it can."""
        shrink = min(1.0, LARGEST[0] / columns, LARGEST[1] / rows)
        reduced = [max(1, round(side * shrink)) for side in (rows, columns)]
        self._size = tuple(side + side % 2 for side in reduced)
        codec = CODECS[self._path.suffix]
        writer = cv2.VideoWriter(str(self._part), cv2.VideoWriter.fourcc(*codec), self._rate,
                                 self._size[::-1])
        if not writer.isOpened():
            writer.release()
            self._part.unlink(missing_ok=True)
            others = ' or '.join(suffix for suffix in CODECS if suffix != self._path.suffix)
            raise ValueError(f'{self._path} cannot be begun: this OpenCV has no encoder {codec}, '
                             f'or the folder is not writable; take {others}, or another folder')
        self._writer = writer

    def _kept(self):
        """Return how many frames the finished file has; the writer tells of no error."""
        video = cv2.VideoCapture(str(self._part))
        try:
            return int(video.get(cv2.CAP_PROP_FRAME_COUNT)) if video.isOpened() else 0
        finally:
            video.release()


class VideoSink:
    """A video of matched pairs: reference image, disparity in colours and confidence."""

    def __init__(self, path, rate, low, high):
        """
        Prepare as a VideoFile does.

        low, high: px, the ends of the disparities' colours.
        """
        self._video, self._range = VideoFile(path, rate), (low, high)

    def take(self, matched):
        """Append the frame of a Matched; raises ValueError as VideoFile.write does."""
        self._video.write(side_by_side(matched, *self._range))

    def close(self):
        """Finish the file; see VideoFile.close."""
        self._video.close()
