# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Write videos, by PyAV or OpenCV: of any frames, and of matched pairs with their maps."""
from contextlib import suppress
from fractions import Fraction
from importlib.util import find_spec
import os
from pathlib import Path

import cv2
from fuzzy_stereo_ros.matching.match import colour_disparity
from fuzzy_stereo_ros.pairs.image_files import check_place, check_suffix, in_eight_bits
import numpy as np

CODECS = {'.mp4': 'mp4v', '.avi': 'MJPG'}       # of OpenCV
# Of PyAV, where it is installed: browsers play H.264 with this format of pixels.
H264, PIXELS = 'libx264', 'yuv420p'
QUALITY = {'crf': '18', 'preset': 'veryfast'}   # good, and no slower than matching
RATES = 0.1, 240.0      # frames per second
LARGEST_FRAME = 4096, 2304  # width and height of a frame in px: limits of players and encoders
PANEL = 320, 1280       # least and largest width of a panel, px
HEAD = 52               # height of the titles, px
TEXT_MARGIN = 8         # between texts, px
BAR = 10                # height of a colour bar, px
LETTERS = 0.5           # font scale of OpenCV
WHITE, DARK_GREY = (235, 235, 235), 32
ENDS = 0.5, 99.5        # percentiles of disparities at the ends of the colours of a picture


class VideoFile:
    """
    A video file, which gets its name when it is closed and complete.

    The first frame sets the size, rounded to even numbers and at most LARGEST_FRAME. Larger frames
    are reduced, smaller ones get a dark border.
    """

    def __init__(self, path, rate):
        """
        Prepare a file, which is created with the first frame; an existing one is replaced.

        path: .mp4 (H.264 by PyAV, which browsers play; without it MPEG-4) or .avi (Motion
        JPEG). rate: frames per second, within RATES.
        Raises ValueError for another suffix, or if the folder does not exist.
        """
        check_suffix(path, CODECS)
        check_place(path)
        self._path, self.rate = Path(path), rate
        # An absolute path: FFmpeg takes a name before a colon as a protocol.
        self._part = self._path.absolute().with_name(
            f'.{self._path.stem}.{os.getpid()}.part{self._path.suffix}')
        self._writer, self._size, self._frames = None, None, 0

    def write(self, frame):
        """Append a frame: uint8 (R, C, 3) BGR; ValueError if this OpenCV has no encoder."""
        if self._writer is None:
            self._begin(*frame.shape[:2])
        self._writer.write(_fitted(frame, *self._size))
        self._frames += 1

    def close(self):
        """Give the file its name, if it has frames; OSError, and no file, if incomplete."""
        writer, self._writer = self._writer, None
        if writer is None:
            return
        writer.release()
        try:
            video = cv2.VideoCapture(str(self._part))   # the writer reports no error
            kept = int(video.get(cv2.CAP_PROP_FRAME_COUNT)) if video.isOpened() else 0
            video.release()
            if kept < self._frames:
                raise OSError(f'{self._path} is incomplete, {kept} of {self._frames} frames, and '
                              'was removed; is the disk full?')
            self._part.replace(self._path)
        finally:
            self._part.unlink(missing_ok=True)

    def _begin(self, rows, columns):
        """Open the writer for frames of a size; raises ValueError if OpenCV cannot."""
        shrink = min(1.0, LARGEST_FRAME[0] / columns, LARGEST_FRAME[1] / rows)
        reduced = [max(1, round(side * shrink)) for side in (rows, columns)]
        self._size = tuple(side + side % 2 for side in reduced)
        kind = self._path.suffix.lower()
        if kind == '.mp4' and find_spec('av') is not None:
            self._writer = _BrowserVideo(self._part, self.rate, *self._size)
            return
        codec = CODECS[kind]
        writer = cv2.VideoWriter(str(self._part), cv2.VideoWriter.fourcc(*codec), float(self.rate),
                                 self._size[::-1])
        if not writer.isOpened():
            writer.release()
            self._part.unlink(missing_ok=True)
            others = ' or '.join(suffix for suffix in CODECS if suffix != kind)
            raise ValueError(f'{self._path} cannot be created: this OpenCV has no encoder '
                             f'{codec}, or the folder is not writable; use {others}, or another '
                             'folder')
        self._writer = writer


class _BrowserVideo:
    """An .mp4 of H.264 by PyAV, with the methods of a cv2.VideoWriter: it reports no error."""

    def __init__(self, path, rate, rows, columns):
        import av

        self._errors = OSError, av.error.FFmpegError
        self._make = av.VideoFrame.from_ndarray
        self._file = av.open(str(path), 'w', options={'movflags': '+faststart'})
        self._stream = self._file.add_stream(H264, rate=Fraction(rate).limit_denominator(1000),
                                             options=QUALITY)
        self._stream.width, self._stream.height = columns, rows
        self._stream.pix_fmt = PIXELS
        self._file.start_encoding()     # creates the file

    def write(self, frame):
        """Append a frame: uint8 (R, C, 3) BGR."""
        with suppress(*self._errors):
            self._file.mux(self._stream.encode(self._make(frame, format='bgr24')))

    def release(self):
        """Write what is still encoded, and close the file."""
        for finish in (lambda: self._file.mux(self._stream.encode()), self._file.close):
            with suppress(*self._errors):
                finish()


def _fitted(frame, rows, columns):
    """Return a frame, uint8 (R, C, 3), fitted to (rows, columns): reduced, with a dark border."""
    scale = min(1.0, rows / frame.shape[0], columns / frame.shape[1])
    if scale < 1:
        frame = cv2.resize(frame, [max(1, round(side * scale)) for side in frame.shape[1::-1]],
                           interpolation=cv2.INTER_AREA)
    return cv2.copyMakeBorder(
        frame, 0, rows - frame.shape[0], 0, columns - frame.shape[1], cv2.BORDER_CONSTANT,
        value=(DARK_GREY,) * 3)


class VideoSink(VideoFile):
    """A video of matched pairs: reference image, disparity in colours and confidence."""

    def __init__(self, path, rate, low, high):
        """Prepare a VideoFile; low, high: px, the range of the colours of disparities."""
        super().__init__(path, rate)
        self._range = low, high

    def add(self, matched, item=None):
        """Append the frame of a MatchedPair; raises ValueError as `write` does."""
        self.write(side_by_side(matched, *self._range))


def side_by_side(matched, low, high):
    """Return reference image, disparity, low to high px, and confidence: uint8 (R, C, 3) BGR."""
    pair, match, side = matched.pair, matched.match, matched.config.reference
    confidence = cv2.convertScaleAbs(match.confidence, alpha=255)
    return np.hstack([
        image_beside_disparity(getattr(pair, side), match.disparity, low, high,
                               f'stamp {pair.stamp / 1e9:.3f} s', ', hatched is invalid',
                               f'{side} image'),
        _headed(_sized(cv2.applyColorMap(confidence, cv2.COLORMAP_VIRIDIS)), 'confidence', '0',
                '1', cv2.COLORMAP_VIRIDIS)])


def image_beside_disparity(image, disparity, low, high, where, found, title='image'):
    """
    Return an image beside its disparities in colours, each below a head: uint8 (R, C, 3) BGR.

    image: uint8 or uint16, (R, C) or (R, C, 3) BGR; disparity: float32 (R, C), px, NaN = invalid;
    low, high: px, the ends of the colours; title, where: two lines above the image; found: words
    behind the title of the disparities
    """
    image = in_eight_bits(image)
    image = image if image.ndim == 3 else cv2.cvtColor(image, cv2.COLOR_GRAY2BGR)
    return np.hstack([
        _headed(_sized(image), title, where, None, None),
        _headed(_sized(colour_disparity(disparity, low, high)), f'disparity [px]{found}',
                f'{low:g}', f'{high:g}', cv2.COLORMAP_TURBO)])


def disparity_picture(disparity):
    """Return disparities, float32 (R, C), px, in colours below a legend: uint8 (R, C, 3) BGR."""
    there = disparity[np.isfinite(disparity)]
    low, high = np.percentile(there, ENDS) if there.size else (0, 1)
    return _headed(_sized(colour_disparity(disparity, low, high)),
                   'disparity [px], hatched is invalid', f'{low:.1f}', f'{high:.1f}',
                   cv2.COLORMAP_TURBO)


def _sized(picture):
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
    """Return a picture below a head: a title, and a text or a colour bar with its ends."""
    head = np.full((HEAD, picture.shape[1], 3), DARK_GREY, np.uint8)
    _write(head, title, TEXT_MARGIN, 20)
    first = _write(head, begin, TEXT_MARGIN, 42)
    if colours is not None:
        width = cv2.getTextSize(end, cv2.FONT_HERSHEY_SIMPLEX, LETTERS, 1)[0][0]
        last = picture.shape[1] - width - 2 * TEXT_MARGIN
        levels = np.linspace(0, 255, last - first).astype(np.uint8)
        head[42 - BAR:42, first:last] = cv2.applyColorMap(levels[np.newaxis], colours)
        _write(head, end, last + TEXT_MARGIN, 42)
    return np.vstack([head, picture])


def _write(head, text, column, row):
    cv2.putText(head, text, (column, row), cv2.FONT_HERSHEY_SIMPLEX, LETTERS, WHITE, 1,
                cv2.LINE_AA)
    width = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, LETTERS, 1)[0][0]
    return column + width + TEXT_MARGIN
