# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Videos by OpenCV's writer: of any frames, and of matched pairs, their maps side by side."""
import os
from pathlib import Path

import cv2
from fuzzy_stereo_ros.pairs.image_files import (
    check_place, colour_disparity, in_eight_bits, INVALID_GREY)
import numpy as np

CODECS = {'.mp4': 'mp4v', '.avi': 'MJPG'}
RATES = 0.1, 240.0      # frames per second
LARGEST = 4096, 2304    # width and height of a frame in pixels; players and encoders have limits
PANEL = 320, 1280       # narrowest and widest picture beside another, px
HEAD = 52               # height of the titles above, px
MARGIN = 8              # px between what stands in the head
BAR = 10                # height of a bar of colours, px
LETTERS = 0.5           # size of the letters, as OpenCV counts it
WHITE = 235, 235, 235


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

    The first frame decides the size, made even and not larger than LARGEST; a larger one is
    reduced, and what remains free of a smaller one is dark.
    """

    def __init__(self, path, rate):
        """
        Prepare; the file is begun with the first frame. An existing one is replaced at the end.

        path: .mp4 (MPEG-4) or .avi (Motion JPEG). rate: frames per second.
        Raises ValueError for another suffix or rate, and where there is no such folder.
        """
        check_video(path, rate)
        self._path, self.rate = Path(path), rate
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
        self._writer.write(_fitted(frame, *self._size))
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
            video = cv2.VideoCapture(str(self._part))   # the writer tells of no error
            kept = int(video.get(cv2.CAP_PROP_FRAME_COUNT)) if video.isOpened() else 0
            video.release()
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
        writer = cv2.VideoWriter(str(self._part), cv2.VideoWriter.fourcc(*codec), float(self.rate),
                                 self._size[::-1])
        if not writer.isOpened():
            writer.release()
            self._part.unlink(missing_ok=True)
            others = ' or '.join(suffix for suffix in CODECS if suffix != self._path.suffix)
            raise ValueError(f'{self._path} cannot be begun: this OpenCV has no encoder {codec}, '
                             f'or the folder is not writable; take {others}, or another folder')
        self._writer = writer


def _fitted(frame, rows, columns):
    """Return a frame, uint8 (R, C, 3), as one of (rows, columns): reduced, and dark beside it."""
    scale = min(1.0, rows / frame.shape[0], columns / frame.shape[1])
    if scale < 1:
        frame = cv2.resize(frame, [max(1, round(side * scale)) for side in frame.shape[1::-1]],
                           interpolation=cv2.INTER_AREA)
    return cv2.copyMakeBorder(
        frame, 0, rows - frame.shape[0], 0, columns - frame.shape[1], cv2.BORDER_CONSTANT,
        value=(INVALID_GREY,) * 3)


class VideoSink(VideoFile):
    """A video of matched pairs: reference image, disparity in colours and confidence."""

    def __init__(self, path, rate, low, high):
        """Prepare as a VideoFile does; low, high: px, the ends of the disparities' colours."""
        super().__init__(path, rate)
        self._range = low, high

    def take(self, matched, logged=None):
        """Append the frame of a MatchedPair; raises ValueError as `write` does."""
        self.write(side_by_side(matched, *self._range))


def side_by_side(matched, low, high):
    """
    Return the reference image, the disparity and the confidence of a pair beside each other.

    Titles stand above, with bars that explain the colours. The picture is uint8 (R, C, 3) BGR.
    low, high: px, the ends of the disparities' colours.
    """
    pair, match, config = matched.pair, matched.match, matched.config
    image = in_eight_bits(getattr(pair, config.reference))
    confidence = cv2.convertScaleAbs(match.confidence, alpha=255)
    panels = [
        (image if image.ndim == 3 else cv2.cvtColor(image, cv2.COLOR_GRAY2BGR),
         f'{config.reference} image', f'stamp {pair.stamp / 1e9:.3f} s', None, None),
        (colour_disparity(match.disparity, low, high), 'disparity [px], grey is invalid',
         f'{low:g}', f'{high:g}', cv2.COLORMAP_TURBO),
        (cv2.applyColorMap(confidence, cv2.COLORMAP_VIRIDIS), 'confidence', '0', '1',
         cv2.COLORMAP_VIRIDIS)]
    return np.hstack([_headed(_sized(picture), *words) for picture, *words in panels])


def _sized(picture):
    """Return a picture wide enough for its title, and not too wide to stand beside two others."""
    narrowest, widest = PANEL
    rows, columns = picture.shape[:2]
    if columns < narrowest:
        times = -(-narrowest // columns)
        return np.repeat(np.repeat(picture, times, axis=0), times, axis=1)
    if columns > widest:
        return cv2.resize(picture, (widest, max(1, round(rows * widest / columns))),
                          interpolation=cv2.INTER_AREA)
    return picture


def _headed(picture, title, begin, end, colours):
    """Return a picture with a head: a title and a line, or a bar of colours with its two ends."""
    head = np.full((HEAD, picture.shape[1], 3), INVALID_GREY, np.uint8)
    _write(head, title, MARGIN, 20)
    first = _write(head, begin, MARGIN, 42)
    if colours is not None:
        width = cv2.getTextSize(end, cv2.FONT_HERSHEY_SIMPLEX, LETTERS, 1)[0][0]
        last = picture.shape[1] - width - 2 * MARGIN
        levels = np.linspace(0, 255, last - first).astype(np.uint8)
        head[42 - BAR:42, first:last] = cv2.applyColorMap(levels[np.newaxis], colours)
        _write(head, end, last + MARGIN, 42)
    return np.vstack([head, picture])


def _write(head, text, column, row):
    """Write text from a column on, standing on a row; return the column behind it."""
    cv2.putText(head, text, (column, row), cv2.FONT_HERSHEY_SIMPLEX, LETTERS, WHITE, 1,
                cv2.LINE_AA)
    width = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, LETTERS, 1)[0][0]
    return column + width + MARGIN
