# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Videos are read back: frames, rate, size, and that they are there as a whole or not at all."""
import os

import cv2
from fuzzy_stereo_ros.matching.match import colour_disparity, HATCH
from fuzzy_stereo_ros.pairs.image_files import in_eight_bits
from fuzzy_stereo_ros.views import video
from fuzzy_stereo_ros.views.video import (
    CODECS, disparity_picture, HEAD, side_by_side, VideoFile, VideoSink)
from made_scenes import DISPARITIES, film, made_matched
import numpy as np
import pytest

RANGE = 0, DISPARITIES - 1
LOSS = 6        # grey levels by which a flat frame may differ after it was compressed


def plain(level, rows=48, columns=64):
    return np.full((rows, columns, 3), level, np.uint8)


def written(path, *frames, rate=10):
    file = VideoFile(path, rate)
    for frame in frames:
        file.write(frame)
    file.close()
    return film(path)


@pytest.mark.parametrize('name, rows, columns', [
    ('video', 48, 64), ('2026-11-22T10:35:18', 47, 64), ('file:left', 48, 63),
    ('drive #2', 49, 65), ('%03d', 1, 1), ('-x', 50, 70)])
@pytest.mark.parametrize('suffix', CODECS)
def test_frames_of_any_size_are_read_back_and_the_file_has_its_name_when_it_is_closed(
        folder, suffix, name, rows, columns):
    """A name in this folder may mean something to FFmpeg; a size that is odd is made even."""
    random = np.random.default_rng(rows)
    levels, rate = random.integers(10, 251, 5), random.choice([0.5, 10, 29.97])
    path = folder / (name + suffix)
    path.write_text('the one before')
    file = VideoFile(path.name, rate)
    assert os.listdir() == [path.name]
    for level in levels:
        file.write(plain(level, rows, columns))
        assert path.read_text() == 'the one before' and len(os.listdir()) == 2
    for _ in range(2):
        file.close()
        assert os.listdir() == [path.name]
    frames, found_rate = film(path)
    assert found_rate == pytest.approx(rate, rel=1e-3)
    assert [frame.shape for frame in frames] == [
        (rows + rows % 2, columns + columns % 2, 3)] * len(levels)
    inner = [slice(0, max(0, side - 20 * (side % 2))) for side in (rows, columns)]
    for frame, level in zip(frames, levels):    # away from the dark row or column of an odd size
        assert abs(frame[tuple(inner)].astype(int) - level).max(initial=0) <= LOSS


def test_the_first_frame_decides_the_size_and_others_are_fitted_into_it(tmp_path):
    frames, _ = written(tmp_path / 'video.avi', plain(200), plain(200, 24, 64), plain(200, 96, 32))
    assert [frame.shape for frame in frames] == [(48, 64, 3)] * 3
    wide, high = (frame[:, :, 1] > 120 for frame in frames[1:])
    assert wide[:24].all() and not wide[24:].any()
    assert high[:, :16].all() and not high[:, 16:].any()


def test_a_browser_can_play_an_mp4_that_pyav_writes(tmp_path):
    av = pytest.importorskip('av', reason='PyAV is not installed: MPEG-4 instead of H.264')
    written(tmp_path / 'video.mp4', *map(plain, (30, 200, 90)), rate=29.97)
    with av.open(str(tmp_path / 'video.mp4')) as found:
        (stream,) = found.streams.video
        assert (stream.codec_context.name, stream.codec_context.pix_fmt) == ('h264', 'yuv420p')
        assert float(stream.average_rate) == pytest.approx(29.97, rel=1e-3)
    content = (tmp_path / 'video.mp4').read_bytes()
    assert content.index(b'moov') < content.index(b'mdat')      # plays while it loads


def test_without_pyav_an_mp4_is_written_by_opencv(tmp_path, monkeypatch):
    monkeypatch.setattr(video, 'find_spec', lambda name: None)
    frames, rate = written(tmp_path / 'video.mp4', plain(30), plain(200))
    assert len(frames) == 2 and rate == 10


@pytest.mark.parametrize('name, words', [
    ('video.mov', "has the suffix '.mov'; allowed are .mp4, .avi"),
    ('none/video.mp4', 'there is no folder')])
def test_what_cannot_be_written_is_rejected_before_the_first_frame(tmp_path, name, words):
    with pytest.raises(ValueError, match=words):
        VideoSink(tmp_path / name, 10, *RANGE)
    VideoFile(tmp_path / 'video.mp4', 10).close()       # without a frame
    assert os.listdir(tmp_path) == []


def test_a_missing_encoder_is_one_sentence_with_the_remedy(tmp_path, monkeypatch, capfd):
    monkeypatch.setitem(CODECS, '.avi', 'none')
    file = VideoFile(tmp_path / 'video.avi', 10)
    with pytest.raises(ValueError, match='no encoder none, or the folder .*; use .mp4, or'):
        file.write(plain(9))
    file.close()
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize('suffix', CODECS)
def test_an_incomplete_video_is_reported_and_removed(tmp_path, suffix, limit_files):
    path, random = tmp_path / f'video{suffix}', np.random.default_rng(0)
    path.write_text('the one before')
    file = VideoFile(path, 10)
    limit_files(100_000)
    for _ in range(20):
        file.write(random.integers(0, 256, (120, 160, 3)).astype(np.uint8))
    with pytest.raises(OSError, match=f'^{path} is incomplete, .* of 20 frames, and was removed; '
                                      'is the disk full[?]$'):
        file.close()
    assert path.read_text() == 'the one before' and os.listdir(tmp_path) == [path.name]


# ---- matched pairs side by side, and their colours ----


@pytest.mark.parametrize('options', [{}, {'colour': True}, {'bits': 12}])
@pytest.mark.parametrize('reference', ['left', 'right'])
def test_a_frame_is_the_reference_image_the_disparity_and_the_confidence(options, reference):
    matched = made_matched(reference=reference, **options)
    pictures = np.split(side_by_side(matched, *RANGE)[HEAD:], 3, axis=1)
    image = in_eight_bits(getattr(matched.pair, reference))
    np.testing.assert_array_equal(
        pictures[0], image if image.ndim == 3 else image[:, :, np.newaxis].repeat(3, axis=2))
    np.testing.assert_array_equal(pictures[1], colour_disparity(matched.match.disparity, *RANGE))
    ramp = cv2.applyColorMap(np.array([[0, 255]], np.uint8), cv2.COLORMAP_VIRIDIS)[0]
    assert (pictures[2][:, 0] == ramp[0]).all() and (pictures[2][:, -1] == ramp[1]).all()


def test_a_picture_of_disparities_has_colours_over_what_is_there_and_a_legend():
    disparity = np.linspace(20, 30, 400, dtype=np.float32)[np.newaxis].repeat(60, axis=0)
    disparity[:, :40] = np.nan
    disparity[0, -1] = 500      # a few wild ones change nothing
    picture = disparity_picture(disparity)
    assert picture.shape == (HEAD + 60, 400, 3) and (picture[:26] > 200).any()
    ramp = cv2.applyColorMap(np.array([[0, 255]], np.uint8), cv2.COLORMAP_TURBO)[0].astype(int)
    assert abs(picture[-1, 42] - ramp[0]).max() < 40 and (picture[-1, 399] == ramp[1]).all()
    assert set(picture[HEAD + 1:, :40].ravel()) == set(HATCH)
    assert disparity_picture(np.full((9, 9), np.nan, np.float32)).shape[2] == 3


def test_far_is_blue_near_is_red_beyond_is_as_the_end_and_invalid_is_hatched_unlike_any():
    far, near, *_ = colour_disparity(np.array([[12, 52]]), 0, 63)[0]
    assert far[0] > 200 > 100 > far[2]
    assert near[2] > 200 > 100 > near[0]
    nothing = colour_disparity(np.array([[np.nan, np.inf] * 20] * 40), 0, 63).reshape(-1, 3)
    levels, counts = np.unique(nothing, axis=0, return_counts=True)
    assert levels.tolist() == [[grey] * 3 for grey in sorted(HATCH)]
    assert counts.min() > 0.4 * counts.sum()
    for shown in colour_disparity(np.linspace(0, 63, 500)[None], 0, 63)[0].astype(int):
        assert np.abs(levels - shown).max(axis=1).min() > 60
    below, low, high, above = colour_disparity(np.array([[-9.0, 5, 20, 99]]), 5, 20)[0]
    assert np.array_equal(below, low) and np.array_equal(above, high)
    assert not np.array_equal(low, high)
