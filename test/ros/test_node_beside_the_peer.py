# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What stereo_image_proc's node gets wrong, with the real node; and the page that says so."""
import re

from fuzzy_stereo_ros.pairs.messages import stamp_of
from migration_page import arguments_of_launched_node, CAMERAS, PAGE
from node_process import shifted_pair, values_of
import numpy as np
import pytest
from repository import ROOT

SHIFT = 7
PAIR = shifted_pair(SHIFT)


@pytest.fixture(scope='module')
def bench(make_bench):
    with make_bench('--ros-args', '-p', 'disparity_range:=16') as bench:
        bench.listen()
        bench.connect()
        bench.first_match(*PAIR)
        yield bench


def test_the_page_names_a_test_for_every_claim_and_each_of_them_exists():
    rows = PAGE.split('## What is better')[1].split('\n\n')[1].splitlines()[2:]
    assert len(rows) > 10
    tests = '\n'.join(file.read_text(encoding='utf-8')
                      for file in (ROOT / 'test').rglob('test_*.py'))
    for row in rows:
        names = re.findall(r'`(test_\w+)`', row)
        assert names, f'no test is named: {row}'
        assert [name for name in names if f'def {name}(' not in tests] == []


def test_the_node_of_the_page_s_launch_file_matches_with_its_remappings_and_parameters(make_bench):
    with make_bench(*arguments_of_launched_node(),
                    cli_args=['--ros-args', *CAMERAS]) as bench:
        bench.listen(namespace='/stereo/')
        bench.connect()
        message = bench.first_match(*PAIR)
        assert (message.min_disparity, message.max_disparity) == (0.0, 31.0)
        assert np.mean(np.abs(values_of(message.image)[:, 31:] - SHIFT) < 0.5) > 0.95
        assert ('are ignored: correlation_window_size, stereo_algorithm, uniqueness_ratio'
                in bench.node.log())


def test_cameras_with_frames_and_focal_lengths_of_their_own_are_matched_in_the_left_frame(bench):
    def differ(messages):
        for topic in ('right/image_rect', 'right/camera_info'):
            messages[topic].header.frame_id = 'right_camera_optical_frame'
        messages['left/camera_info'].p[0] = 201.0

    mark = bench.node.mark()
    message = bench.match(*PAIR, change=differ)
    assert message.header.frame_id == 'left_camera_optical_frame'
    assert message.f == 200.0
    bench.node.logged('fx is 201 in the left and 200 in the right camera_info', mark)


@pytest.mark.parametrize('value', [0.0, float('nan')])
def test_an_uncalibrated_camera_is_refused_with_a_sentence_and_nothing_is_published(bench, value):
    def uncalibrate(messages):
        for side in ('left', 'right'):
            messages[f'{side}/camera_info'].p = [value] * 12
            messages[f'{side}/camera_info'].k = [value] * 9

    def refusals():
        return int(bench.counts().get('refused: calibration', 0))

    before = refusals()
    refused = bench.rig.publish(*PAIR, change=uncalibrate)
    bench.until(lambda: refusals() > before, 'a refusal')
    assert 'left camera_info: ' in bench.node.log()
    bench.match(*PAIR)
    assert refused not in bench.disparities


def test_the_header_is_the_left_image_s_whatever_stands_in_the_camera_info(bench):
    def rename(messages):
        for side in ('left', 'right'):
            messages[f'{side}/camera_info'].header.frame_id = 'somewhere_else'

    message = bench.match(*PAIR, stamp=77_000_000_001, change=rename)
    assert stamp_of(message.header) == stamp_of(message.image.header) == 77_000_000_001
    assert message.header.frame_id == message.image.header.frame_id == 'left_camera_optical_frame'


def test_a_binned_region_keeps_metres(bench):
    """Of a full image of 300x200 the region of 240x120 at (40, 30), binned by two, comes out."""
    def bin_a_region(messages):
        for side in ('left', 'right'):
            info = messages[f'{side}/camera_info']
            info.width, info.height, info.binning_x, info.binning_y = 300, 200, 2, 2
            info.roi.x_offset, info.roi.y_offset = 40, 30
            info.roi.width, info.roi.height = 240, 120
            info.p = [400.0, 0, 150, -48.0 if side == 'right' else 0, 0, 400.0, 100, 0, 0, 0, 1, 0]

    mark = bench.node.mark()
    message = bench.match(*PAIR, change=bin_a_region)
    assert (message.f, message.t) == pytest.approx((200.0, 0.12))
    assert message.min_disparity == 0.0
    assert np.mean(np.abs(values_of(message.image)[:, 15:] - SHIFT) < 0.5) > 0.95
    assert 'expects' not in bench.node.log(mark)


@pytest.mark.parametrize('disparities, min_disparity, window', [
    (16, -20, (0, 100)), (120, 0, (119, 1)), (16, 500, (120, 0))])
def test_the_valid_window_of_the_real_node_lies_inside_the_image(
        bench, disparities, min_disparity, window):
    assert bench.change(disparity_range=disparities, min_disparity=min_disparity) == (True, '')
    try:
        found = bench.match(*PAIR).valid_window
    finally:
        assert bench.change(disparity_range=16, min_disparity=0) == (True, '')
    assert (found.x_offset, found.width) == window
    assert (found.y_offset, found.height) == (0, 60)
