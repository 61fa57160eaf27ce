# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The maps of a rectification, against a plain camera and what a lens cannot show."""
from fuzzed import examples
from fuzzy_stereo_ros.pairs.pair_reader import is_inside, OFF_IMAGE, raw_positions
from hypothesis import given, strategies as st
from made_messages import info, region, rejection_of
import numpy as np
import pytest
from raw_camera import CENTRE, COLUMNS, FOCAL, LENSES, RawCamera, ROWS

CAMERAS = {'left': RawCamera(turn=(0.02, -0.03, 0.015)),
           'right': RawCamera(turn=(-0.015, 0.025, -0.01), right=0.1)}
NAMES = {'plumb_bob': ['plumb_bob', 'radial-tangential'], 'equidistant': ['Fisheye', 'equi'],
         'rational_polynomial': ['rational_polynomial'], '': ['']}


def places_of(camera_info, rows=ROWS, columns=COLUMNS):
    return np.stack(raw_positions('left', camera_info, rows, columns))


def plane(camera, depth):
    """Return the points at a depth that the pixels of a camera's rectified image show."""
    down, across = np.mgrid[:ROWS, :COLUMNS].astype(np.float64)
    return np.stack([(across - CENTRE[0]) / FOCAL * depth + camera.right,
                     (down - CENTRE[1]) / FOCAL * depth, np.full((ROWS, COLUMNS), depth)])


@examples(40)
@given(data=st.data(), model=st.sampled_from([*LENSES]), side=st.sampled_from([*CAMERAS]),
       depth=st.floats(0.5, 20), bins=st.tuples(*2 * [st.integers(1, 4)]),
       begin=st.tuples(*2 * [st.integers(0, 40)]))
def test_a_rectified_pixel_comes_from_where_the_camera_sees_its_point(
        data, model, side, depth, bins, begin):
    """Whatever a lens is called, how many zeros follow its coefficients, binning and region."""
    camera = RawCamera(model, CAMERAS[side].turn, CAMERAS[side].right)
    (across, down), (x, y) = bins, begin
    rows, columns = (ROWS - y) // down, (COLUMNS - x) // across
    named = camera.info(
        binning_x=across, binning_y=down, roi=region(x, y, rows * down, columns * across),
        distortion_model=data.draw(st.sampled_from([model, *NAMES[model]])))
    named.d = named.d + [0.0] * (model == 'equidistant')
    seen = np.stack(camera.sees(plane(camera, depth)))[
        :, y:y + rows * down:down, x:x + columns * across:across]
    np.testing.assert_allclose(
        places_of(named, rows, columns), (seen - [[[x]], [[y]]]) / [[[across]], [[down]]],
        rtol=0, atol=1e-4)


@pytest.mark.parametrize('changes', [
    {'d': []}, {'d': [0.0] * 5}, {'d': [], 'distortion_model': ''},
    {'d': [0.1] * 5, 'distortion_model': ''}, {'d': [0.0] * 6, 'distortion_model': 'unheard of'}])
def test_a_camera_without_distortion_or_turn_is_left_as_it_is(changes):
    down, across = np.mgrid[:80, :100]
    places = places_of(info(**changes), 80, 100)
    np.testing.assert_allclose(places, [across, down], rtol=0, atol=1e-4)
    assert is_inside(*places, 80, 100).all()


@pytest.mark.parametrize('model, coefficients, last', [
    ('plumb_bob', [-0.4, 0, 0, 0, 0], 1 / np.sqrt(3 * 0.4)),
    ('rational_polynomial', [0, 0, 0, 0, 0, 1.0, 0, 0], 1.0),
    ('rational_polynomial', [0, 0, 0, 0, 0, -1.0, 0, 0], 1.0),
    ('equidistant', [-0.5, 0, 0, 0], np.tan(np.sqrt(1 / 1.5)))])
def test_what_lies_beyond_where_a_lens_turns_back_comes_from_nowhere(model, coefficients, last):
    strong = info(distortion_model=model, d=coefficients,
                  p=[30.0, 0, 50, 0, 0, 30, 40, 0, 0, 0, 1, 0])
    down, across = np.mgrid[:80, :100]
    radius = np.hypot(across - 50, down - 40) / 30
    nowhere = (places_of(strong, 80, 100) == OFF_IMAGE).all(axis=0)
    assert nowhere[radius > last + 0.01].all()
    assert not nowhere[radius < last - 0.01].any()


def test_a_place_is_inside_where_its_four_pixels_are():
    x, y = np.float32([0, -0.01, -0.02, 9, 9.01, 9.02, 5, 5, np.inf]), np.float32([0] * 9)
    y[6:8] = 4, 4.5
    inside = [True, True, False, True, True, False, True, False, False]
    assert is_inside(x, y, 5, 10).tolist() == inside


@pytest.mark.parametrize('changes, sentence', [
    ({'r': [0.0] * 9}, 'left camera_info: R is not a rotation; calibrate the two cameras as a'),
    ({'r': [1.0, 0, 0, 0, 1, 0, 0, 0, -1]}, 'left camera_info: R is not a rotation'),
    ({'k': [200.0, 0, 50, 0, 0, 40, 0, 0, 1]}, 'left camera_info: K is not of a calibrated'),
    ({'distortion_model': 'fov', 'd': [0.9]},
     "left camera_info: distortion_model is 'fov'; allowed are plumb_bob, rational_polynomial, "
     'equidistant; for others'),
    ({'d': [0.1] * 3}, 'left camera_info: D has 3 numbers; allowed for plumb_bob are 4, 5, 8,'),
    ({'d': [0.1, float('nan'), 0, 0]}, 'left camera_info: D has 4 numbers; allowed for plumb_bo'),
])
def test_a_camera_that_cannot_be_rectified_is_rejected_with_a_sentence(changes, sentence):
    rejection = rejection_of(raw_positions, 'left', info(**changes), 80, 100)
    assert rejection.reason == 'calibration'
    assert str(rejection).startswith(sentence)


@pytest.mark.parametrize('name', ['equidistant', 'fisheye', 'Kannala-Brandt', 'equi'])
@pytest.mark.parametrize('d', [[], [0.0] * 4, [0.0] * 5, [0.0] * 14])
def test_a_fisheye_without_coefficients_has_angles_proportional_to_radii(name, d):
    """Where a pinhole shows the tangent of an angle."""
    fisheye = info(distortion_model=name, d=d, p=[60.0, 0, 50, 0, 0, 60, 40, 0, 0, 0, 1, 0])
    down, across = np.mgrid[:80, :100]
    x, y = (across - 50) / 60, (down - 40) / 60
    radius = np.maximum(np.hypot(x, y), 1e-12)
    ratio = 200 * np.arctan(radius) / radius
    np.testing.assert_allclose(places_of(fisheye, 80, 100), [50 + ratio * x, 40 + ratio * y],
                               rtol=0, atol=1e-3)
