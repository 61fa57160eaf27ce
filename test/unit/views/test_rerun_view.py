# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What is shown in the Rerun viewer; tests that need rerun-sdk are skipped where it is not."""
import os
import subprocess
import sys

from fuzzy_stereo_ros.views import rerun_view
from fuzzy_stereo_ros.views.rerun_view import points_of, reference_projection, RerunSink
from matched_scene import CALIBRATION, made_matched
import numpy as np
import pytest
from recordings import needed_rerun, rows_of


@pytest.fixture
def rerun(monkeypatch):
    """Return the module."""
    return needed_rerun(monkeypatch)


def twin_points(matched, camera):
    """Return the points and colours of the pixels, one by one."""
    image, found = matched.pair.left, []
    for row, column in np.ndindex(image.shape[:2]):
        away = matched.match.disparity[row, column] - CALIBRATION.offset
        if away >= 1:
            z = CALIBRATION.focal * CALIBRATION.baseline / away
            found.append((z * (column - camera.cx) / camera.fx, z * (row - camera.cy) / camera.fy,
                          z, *np.broadcast_to(image[row, column], 3)[::-1]))
    return np.array(found)


@pytest.mark.parametrize('colour', [False, True])
def test_points_are_those_of_the_valid_pixels_in_their_colours(colour):
    matched = made_matched(20, 40, colour=colour)
    camera = CALIBRATION.left
    places, colours = points_of(matched.match.disparity, matched.pair.left, CALIBRATION, camera)
    expected = twin_points(matched, camera)
    assert 0 < len(expected) < 20 * 40
    np.testing.assert_allclose(places, expected[:, :3], rtol=1e-5)
    np.testing.assert_array_equal(colours, expected[:, 3:])


def test_pixels_are_left_out_evenly_where_there_are_too_many(monkeypatch):
    matched = made_matched(21, 40)
    disparity, image = matched.match.disparity, matched.pair.left
    monkeypatch.setattr(rerun_view, 'MOST_POINTS', 21 * 40 // 9 + 1)
    found = points_of(disparity, image, CALIBRATION, CALIBRATION.left)
    kept = np.full_like(disparity, np.nan)
    kept[::3, ::3] = disparity[::3, ::3]
    monkeypatch.undo()
    for thinned, expected in zip(found, points_of(kept, image, CALIBRATION, CALIBRATION.left)):
        np.testing.assert_array_equal(thinned, expected)


def test_what_hardly_has_a_disparity_is_no_point():
    disparity = np.array([[0.9, 1.0, 5.0, np.nan]], np.float32) + np.float32(CALIBRATION.offset)
    places, _ = points_of(disparity, np.zeros((1, 4), np.uint8), CALIBRATION, CALIBRATION.left)
    np.testing.assert_allclose(places[:, 2], [40, 8])


def test_the_right_camera_has_its_own_principal_point():
    assert reference_projection(CALIBRATION, 'left') == CALIBRATION.left
    assert reference_projection(CALIBRATION, 'right') == CALIBRATION.left._replace(cx=170.0 + 1.5)


def test_without_rerun_the_sentence_has_the_remedy(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, 'rerun', None)
    with pytest.raises(ValueError, match='not installed .*: pip install rerun-sdk'):
        RerunSink(tmp_path / 'out.rrd')
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize('name, words', [
    ('out.bag', "has the suffix '.bag'; allowed is .rrd"),
    ('none/out.rrd', 'there is no folder')])
def test_a_file_that_cannot_be_written_so_is_rejected(tmp_path, name, words):
    with pytest.raises(ValueError, match=words):
        RerunSink(tmp_path / name)


def test_without_a_display_the_viewer_is_not_started(rerun, monkeypatch):
    monkeypatch.setattr(sys, 'platform', 'linux')
    for name in ('DISPLAY', 'WAYLAND_DISPLAY'):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(ValueError, match='no display; write a file .rrd'):
        RerunSink()


def test_a_recording_holds_every_pair_and_has_its_name_when_it_is_closed(rerun, tmp_path):
    path = tmp_path / 'out.rrd'
    path.write_text('the one before')
    sink = RerunSink(path)
    for number, options in enumerate(({}, {'colour': True}, {'bits': 12},
                                      {'reference': 'right'})):
        sink.add(made_matched(stamp=number * 100_000_000, **options))
    assert path.read_text() == 'the one before'
    sink.close()
    assert os.listdir(tmp_path) == ['out.rrd']
    sink.close()
    rows = rows_of(path)
    assert {entity: rows[entity] for entity in (
        'rig/camera', 'rig/camera/image', 'rig/points', 'disparity', 'confidence')} == {
        'rig/camera': 4, 'rig/camera/image': 4, 'rig/points': 4, 'disparity': 4, 'confidence': 4}


FULL_DISK = """
import resource, sys
from fuzzy_stereo_ros.views.rerun_view import RerunSink
from matched_scene import made_matched
resource.setrlimit(resource.RLIMIT_FSIZE, (300_000, 300_000))
sink = RerunSink(sys.argv[1])
for stamp in range(20):
    sink.add(made_matched(stamp=stamp))
try:
    sink.close()
except OSError as error:
    print(error)
"""


def test_an_incomplete_recording_is_reported_and_removed(rerun, tmp_path):
    ended = subprocess.run(
        [sys.executable, '-c', FULL_DISK, tmp_path / 'out.rrd'], capture_output=True, text=True,
        check=True, env={**os.environ, 'PYTHONPATH': os.pathsep.join(filter(None, sys.path))})
    assert ended.stdout.startswith(f"{tmp_path / 'out.rrd'} is incomplete and was removed: ")
    assert os.listdir(tmp_path) == []
