# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Frames are found in the folders and videos that recorders leave, and what is no frame is not."""
import cv2
from fuzzy_stereo_ros.pairs.frames import are_pairs, Frames, LAYOUTS
from fuzzy_stereo_ros.pairs.image_files import write_image
import numpy as np
import pytest


def image(number):
    return np.full((4, 6), number, np.uint8)


def written(folder, names):
    """Write an image for each name, of the level that is its place; return the folder."""
    for number, name in enumerate(names):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        write_image(folder / name, image(number))
    return folder


def levels(*paths):
    """Return the level of the left and of the right image of each pair."""
    return [(int(left.read()[0, 0]), int(right.read()[0, 0]))
            for _, left, right in Frames(paths).pairs()]


@pytest.mark.parametrize('names', [
    ['left-0000', 'right-0000', 'left-0001', 'right-0001'],         # camera_calibration
    ['left000000', 'right000000', 'left000001', 'right000001', 'depth000000'],      # ZED
    ['rs_Infrared_1_1738133056812.3', 'rs_Infrared_2_1738133056812.3',
     'rs_Infrared_1_1738133056845.6', 'rs_Infrared_2_1738133056845.6',
     'rs_Color_1738133056812.3'],
    ['0007_L', '0007_R', '0008_L', '0008_R', '0009_L', '.0009_R'],
    ['cam0_left_arm_3', 'cam1_left_arm_3', 'cam0_left_arm_12', 'cam1_left_arm_12'],
    ['left_arm/a_left', 'left_arm/a_right', 'left_arm/b_left', 'left_arm/b_right']])
def test_one_folder_with_the_images_of_both_cameras_is_paired_by_their_names(tmp_path, names):
    folder = written(tmp_path, [f'{name}.png' for name in names]) / names[0].rpartition('/')[0]
    assert are_pairs([folder]) and levels(folder) == [(0, 1), (2, 3)]
    assert str(folder / '*') in Frames([folder]).name


@pytest.mark.parametrize('layout', LAYOUTS)
def test_the_folders_of_both_cameras_are_found_in_that_of_a_recording(tmp_path, layout):
    times = [1403636579763555584, 1403636579813555456]
    folder = written(tmp_path, [f'{side}/{time}.png' for time in times for side in layout])
    frames = Frames([folder])
    assert levels(folder) == [(0, 1), (2, 3)]
    assert [stamp for stamp, _, _ in frames.pairs()] == [frames.begin, frames.end] == times


def test_a_folder_of_one_camera_or_of_four_is_none_of_two(tmp_path):
    one = written(tmp_path / 'one', [f'camera_{number}.png' for number in range(2)])
    four = written(tmp_path / 'four', [f'cam{number}_0.png' for number in range(4)])
    for folder in (one, four):
        assert not are_pairs([folder])
        with pytest.raises(ValueError, match='no images that are named by their camera'):
            Frames([folder])


def test_hidden_files_and_companions_of_other_systems_are_no_images(tmp_path):
    folder = written(tmp_path, ['left/0.png', 'right/0.png', 'left/1.png', 'right/1.png'])
    for name in ('left/._0.png', 'right/._1.png', 'left/.2.png', 'left/Thumbs.db',
                 'right/desktop.ini', 'left/0.png:Zone.Identifier', '__MACOSX/._left'):
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_bytes(b'\0\5\x16\7\0\2\0\0Mac OS X')
    for paths in ([folder], [folder / 'left', folder / 'right'],
                  [f'{folder}/left/*', f'{folder}/right/*'],
                  [f'{folder}/left/*', f'{folder}/right/[.0-9]*']):
        assert levels(*paths) == [(0, 1), (2, 3)]


def test_equal_names_in_several_folders_pair_within_each(tmp_path):
    written(tmp_path, [f'{run}/{side}/{number}.PNG' for run in ('b', 'a') for number in (10, 9)
                       for side in ('left', 'right')] + ['a/left/8.PNG', 'b/right/8.PNG'])
    assert levels(f'{tmp_path}/*/left/*', f'{tmp_path}/*/right/*') == [
        (6, 7), (4, 5), (2, 3), (0, 1)]


def without_duration(content):
    """Return a .mkv as live recorders write it: a void element stands for its duration."""
    place = content.index(b'\x44\x89\x88')
    return content[:place] + b'\xec\x89' + content[place + 2:]


@pytest.mark.parametrize('count', [1, 45])
def test_a_video_that_does_not_know_its_length_is_read_to_its_end(tmp_path, count):
    video = cv2.VideoWriter(str(tmp_path / 'whole.mkv'), cv2.VideoWriter.fourcc(*'MJPG'), 30.,
                            (320, 120))
    for number in range(count):
        video.write(np.full((120, 320, 3), 5 * number, np.uint8))
    video.release()
    content = (tmp_path / 'whole.mkv').read_bytes()
    (tmp_path / 'live.mkv').write_bytes(without_duration(content))
    for name in ('whole.mkv', 'live.mkv'):
        frames = Frames([tmp_path / name])
        stamps = [stamp for stamp, _, _ in frames.pairs()]
        assert stamps == [round(number * 1e9 / 30) for number in range(count)]
        assert (frames.counts, frames.end) == ({'left': count, 'right': count}, stamps[-1])
        assert [round(frame.read().mean() / 5) for _, frame, _ in frames.pairs()] == [
            *range(count)]


def test_a_video_is_read_as_it_is_stored_whatever_its_orientation(tmp_path):
    """As images are: turned, the rows of a pair would be its columns."""
    video = cv2.VideoWriter(str(tmp_path / 'left.mp4'), cv2.VideoWriter.fourcc(*'mp4v'), 30.,
                            (64, 32))
    video.write(np.zeros((32, 64, 3), np.uint8))
    video.release()
    content = (tmp_path / 'left.mp4').read_bytes()
    place = content.index(b'tkhd') + 44         # of the matrix
    turned = np.array([0, 1 << 16, 0, -1 << 16, 0, 0, 32 << 16, 0, 1 << 30], '>i4').tobytes()
    (tmp_path / 'right.mp4').write_bytes(content[:place] + turned + content[place + 36:])
    (_, left, right), = Frames([tmp_path / 'left.mp4', tmp_path / 'right.mp4']).pairs()
    assert left.read().shape == right.read().shape == (32, 64, 3)
