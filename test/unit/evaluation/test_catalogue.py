# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Scenes are recognised by what their folders hold, and read as their data sets mean them."""
from types import SimpleNamespace

from fuzzy_stereo_ros.evaluation.catalogue import search
from fuzzy_stereo_ros.evaluation.ground_truth import (
    agreeing, KITTI, MIDDLEBURY, seen_by_both, warped_to_right)
from fuzzy_stereo_ros.pairs.disparity_files import write_disparity
from fuzzy_stereo_ros.pairs.image_files import write_image
import numpy as np
import pytest
from written_scenes import (
    frames, grey_truth, in_kitti_steps, pair, write_2014, write_frames, write_images,
    write_kitti, write_masks, write_named, write_v2)

GREY_SIDES, COLOUR_SIDES = ('image_0', 'image_1'), ('colored_0', 'colored_1')
TRUTHS_2012 = 'disp_occ', 'disp_noc'


def expected(truth, masks, family=MIDDLEBURY, disparities=None, source='', **more):
    return SimpleNamespace(truth=truth, masks=masks, family=family, disparities=disparities,
                           source=source, **{'name': 'scene', 'scale': None, **more})


def v2_with_masks(folder):
    made = pair()
    truth = write_v2(folder / 'venus', made, 8)
    return expected(truth, write_masks(folder / 'venus', made), name='venus', scale=8)


def v2_without_masks(folder):
    truth = write_v2(folder / 'poster', pair(), 8, '.ppm')
    right = grey_truth(warped_to_right(truth), 8)[1]
    return expected(truth, {'nonocc': agreeing(truth, right), 'all': np.isfinite(truth)},
                    name='poster', scale=8)


def sets_of_2006(folder):
    made = pair()
    write_images(folder / 'Moebius', made, 'view1.png', 'view5.png')
    levels, truth = grey_truth(made.truth, 3)
    write_image(folder / 'Moebius' / 'disp1.png', levels)
    return expected(truth, {'nonocc': seen_by_both(truth), 'all': np.isfinite(truth)},
                    name='Moebius', scale=3)


def of_2014_with_a_mask(folder):
    made = pair()
    write_2014(folder / 'scene', made, ndisp=29)
    write_image(folder / 'scene' / 'mask0nocc.png',
                np.where(made.visible, 255, 128).astype(np.uint8))
    return expected(made.truth, {'nonocc': made.visible, 'all': np.isfinite(made.truth)},
                    disparities=29, source='calib.txt')


def of_2014_without_a_mask(folder):
    made = pair()
    write_2014(folder / 'scene', made, 'disp0.pfm')
    return expected(made.truth, {'nonocc': seen_by_both(made.truth),
                                 'all': np.isfinite(made.truth)})


def of_2014_with_the_truth_of_the_right_image(folder):
    made = pair()
    write_2014(folder / 'scene', made, 'disp0.pfm')
    right = warped_to_right(made.truth)
    right[:, 40:] = np.nan
    write_disparity(folder / 'scene' / 'disp1.pfm', right)
    return expected(made.truth, {'nonocc': agreeing(made.truth, right),
                                 'all': np.isfinite(made.truth)})


def kitti(folder, sides, truths):
    made = pair()
    write_kitti(folder / 'training', made, '000000_10.png', sides, truths)
    truth = in_kitti_steps(made.truth)
    masks = {'nonocc': made.visible, 'all': np.isfinite(truth)}
    return truth, {name: masks[name] for name in ('nonocc', 'all')[-len(truths):]}


def kitti_2015(folder):
    return expected(*kitti(folder, ('image_2', 'image_3'), ('disp_occ_0', 'disp_noc_0')), KITTI,
                    name='000000_10')


def kitti_2012(folder):
    return expected(*kitti(folder, GREY_SIDES, TRUTHS_2012), KITTI, name='000000_10')


def kitti_2012_in_colour(folder):
    return expected(*kitti(folder, COLOUR_SIDES, TRUTHS_2012[:1]), KITTI, name='000000_10')


def kitti_without_hidden_pixels(folder):
    truth, _ = kitti(folder, GREY_SIDES, TRUTHS_2012)
    for file in (folder / 'training' / 'disp_occ').iterdir():
        file.unlink()
    seen = pair().visible
    return expected(np.where(seen, truth, np.nan), {'nonocc': seen}, KITTI, name='000000_10')


def named_with_a_scale(folder):
    made = pair()
    write_images(folder / 'scene', made, 'left.png', 'right.png')
    levels, truth = grey_truth(made.truth, 16)
    write_image(folder / 'scene' / 'groundtruth.png', np.dstack([levels] * 3))
    (folder / 'scene' / 'info.txt').write_text('16\n15')
    write_image(folder / 'scene' / 'nonocc_derived.png', made.visible * np.uint8(255))
    return expected(truth, {'nonocc': made.visible, 'all': np.isfinite(truth)}, disparities=16,
                    source='info.txt')


def named_in_pixels(folder):
    made = pair()
    write_images(folder / 'scene', made, 'left.png', 'right.png')
    np.savez(folder / 'scene' / 'groundtruth.npz', made.truth)
    return expected(made.truth, {'nonocc': seen_by_both(made.truth),
                                 'all': np.isfinite(made.truth)})


def named_like_kitti(folder):
    made = pair()
    write_named(folder / 'scene', made, 'disp_occ_0.png')
    truth = in_kitti_steps(made.truth)
    return expected(truth, {'all': np.isfinite(truth)}, KITTI)


def one_numbered_frame(folder):
    made = pair()
    write_frames(folder / 'scene', [made], known=[7])
    return expected(made.truth, {'nonocc': seen_by_both(made.truth),
                                 'all': np.isfinite(made.truth)}, name='07')


def made_frame(folder):
    made = pair()
    write_frames(folder / 'scene', [made], [7], True, 'truth.pfm', 'visible.png')
    (folder / 'scene' / 'calib.txt').write_text('doffs=0\nndisp=33\nvmin=2\n')
    return expected(made.truth, {'nonocc': made.visible, 'all': np.isfinite(made.truth)},
                    disparities=33, source='calib.txt', name='0007')


CASES = [
    v2_with_masks, v2_without_masks, sets_of_2006,
    of_2014_with_a_mask, of_2014_without_a_mask, of_2014_with_the_truth_of_the_right_image,
    kitti_2015, kitti_2012, kitti_2012_in_colour, kitti_without_hidden_pixels,
    named_with_a_scale, named_in_pixels, named_like_kitti,
    one_numbered_frame, made_frame]


@pytest.mark.parametrize('write', CASES)
def test_a_scene_is_recognised_and_read_as_its_data_set_means_it(write, tmp_path):
    """Also beside the companions of its files that macOS writes on other disks."""
    wanted = write(tmp_path)
    for path in [*tmp_path.rglob('*.*')]:
        path.with_name(f'._{path.name}').write_bytes(b'\0\5\x16\7')
    found = search([tmp_path], wanted.scale)
    (scene,) = found.scenes
    assert not found.sequences and not found.skipped
    assert (scene.name, scene.family) == (wanted.name, wanted.family)
    assert (scene.disparities, scene.source) == (wanted.disparities, wanted.source)
    known = scene.read()
    np.testing.assert_array_equal(known.truth, wanted.truth)
    assert list(known.masks) == list(wanted.masks)
    for name, mask in wanted.masks.items():
        np.testing.assert_array_equal(known.masks[name], mask, err_msg=name)
    assert known.left.shape[:2] == known.right.shape[:2] == known.truth.shape


@pytest.mark.parametrize('ndisp', [0, 4097, 10**30])
def test_a_number_of_disparities_that_cannot_be_searched_is_rejected_by_file(tmp_path, ndisp):
    write_2014(tmp_path / 'scene', pair(), ndisp=ndisp)
    with pytest.raises(ValueError, match=f'scene/calib.txt has ndisp={ndisp}: disparities is '
                       f'{ndisp}; allowed are whole numbers from 1 to 4096; remove the line or'):
        search([tmp_path])


def test_a_truth_of_8_bits_that_nothing_explains_takes_the_scale_that_is_given(tmp_path):
    made = pair()
    truth = write_v2(tmp_path / 'mine', made, 5)
    write_v2(tmp_path / 'venus', made, 8)
    (tmp_path / 'venus' / 'info.txt').write_text('8 19')
    with pytest.raises(ValueError, match='disp2.png has 8 bits and no known scale: give --tru'):
        search([tmp_path])
    mine, venus = search([tmp_path], truth_scale=5).scenes
    np.testing.assert_array_equal(mine.read().truth, truth)
    assert venus.files[''].scale == 8


def test_all_files_of_kitti_are_found_and_the_frames_before_make_a_sequence(tmp_path):
    several = frames(3)
    sides, truths = ('image_2', 'image_3'), ('disp_occ_0', 'disp_noc_0')
    for number, made in zip((8, 9, 10, 11), [*several, several[0]]):
        write_kitti(tmp_path, made, f'000003_{number:02}.png', sides,
                    truths if number == 10 else ())
    write_kitti(tmp_path, pair(), '000001_10.png', sides, truths)
    found = search([tmp_path])
    assert [scene.name for scene in found.scenes] == ['000001_10', '000003_10']
    (sequence,) = found.sequences
    assert (sequence.name, list(sequence.files)) == ('000003', ['08', '09', '10', '11'])
    assert [files.truth is not None for files in sequence.files.values()] == [
        False, False, True, False]


@pytest.mark.parametrize('in_folders', [False, True])
def test_numbered_frames_are_a_sequence_and_those_with_a_truth_are_scenes(tmp_path, in_folders):
    several = frames(4)
    write_frames(tmp_path / 'drive', several, known=[8, 10], in_folders=in_folders)
    found = search([tmp_path])
    (sequence,) = found.sequences
    numbers = list(sequence.files)
    assert [int(number) for number in numbers] == [7, 8, 9, 10]
    assert sequence.name == 'drive'
    assert [scene.name for scene in found.scenes] == [f'drive/{numbers[1]}', f'drive/{numbers[3]}']
    for made, files in zip(several, sequence.files.values()):
        known = files.read()
        np.testing.assert_array_equal(known.left, made.left)
        np.testing.assert_array_equal(known.right, made.right)
    np.testing.assert_array_equal(known.truth, several[-1].truth)


def test_frames_are_ordered_by_number_and_not_by_letter(tmp_path):
    for number in (9, 10, 100):
        write_images(tmp_path, pair(), f'left_{number}.png', f'right_{number}.png')
    (sequence,) = search([tmp_path]).sequences
    assert list(sequence.files) == ['9', '10', '100']


def test_scenes_are_named_by_their_place_below_what_holds_all(tmp_path):
    for place in ('one/training/a', 'one/training/b', 'two/training/a'):
        write_named(tmp_path / place, pair())
    names = [scene.name for scene in search([tmp_path]).scenes]
    assert names == ['one/training/a', 'one/training/b', 'two/training/a']
    given = [tmp_path / 'two', tmp_path / 'one' / 'training' / 'a', tmp_path / 'two' / 'training']
    assert [scene.name for scene in search(given).scenes] == ['two/training/a', 'one/training/a']
    assert [scene.name for scene in search([tmp_path / 'one' / 'training' / 'b']).scenes] == ['b']
    assert [scene.name for scene in search([tmp_path], only='ing/b').scenes] == ['one/training/b']
    assert [scene.name for scene in search([tmp_path], only='two').scenes] == ['two/training/a']


def test_links_that_lead_back_are_not_followed_for_ever(tmp_path):
    write_named(tmp_path / 'scene', pair())
    for name in 'abc':
        (tmp_path / name).symlink_to(tmp_path, target_is_directory=True)
    assert [scene.name for scene in search([tmp_path]).scenes] == ['scene']


def test_a_scene_without_a_truth_is_skipped_and_said_where_others_have_one(tmp_path):
    write_named(tmp_path / 'a', pair())
    write_images(tmp_path / 'b', pair(), 'im0.png', 'im1.png')
    found = search([tmp_path])
    assert [scene.name for scene in found.scenes] == ['a']
    (sentence,) = found.skipped
    assert sentence == (f"{tmp_path / 'b'} has images but no ground truth: there is no "
                        'disp0GT')
    with pytest.raises(ValueError, match='has images but no ground truth'):
        search([tmp_path / 'b'])


def without(*names):
    def spoil(folder):
        write_2014(folder, pair(), ndisp=16)
        for name in names:
            (folder / name).unlink()
    return spoil


def frame_without_a_right_image(folder):
    write_frames(folder, frames(3))
    (folder / 'right_08.png').unlink()


def mask_of_another_size(folder):
    write_2014(folder, pair())
    write_image(folder / 'mask0nocc.png', np.zeros((5, 6), np.uint8))


def truth_of_another_size(folder):
    write_2014(folder, pair())
    write_disparity(folder / 'disp0GT.pfm', np.zeros((5, 6)))


def damaged(folder):
    write_2014(folder, pair())
    (folder / 'disp0GT.pfm').write_bytes(b'no such thing')


@pytest.mark.parametrize(('spoil', 'reason'), [
    (lambda folder: None, 'there is no scene below .*; known layouts are Middlebury v2'),
    (without('im1.png'), 'im1.png is missing; .*im0.png has no right image'),
    (without('disp0GT.pfm'), 'no ground truth: there is no disp0GT'),
    (frame_without_a_right_image, 'right_08.png is missing; .*left_08.png has no right image'),
    (mask_of_another_size, 'mask0nocc.png is 6x5, the images are 72x40'),
    (truth_of_another_size, 'disp0GT.pfm is 6x5, the images are 72x40'),
    (damaged, 'disp0GT.pfm is not a PFM file'),
])
def test_an_incomplete_scene_is_rejected_with_the_name_of_its_file(spoil, reason, tmp_path):
    spoil(tmp_path)
    with pytest.raises(ValueError, match=reason):
        for scene in search([tmp_path]).scenes:
            scene.read()


def test_a_missing_folder_and_a_word_that_no_name_has_are_rejected(tmp_path):
    with pytest.raises(ValueError, match='there is no folder .*nowhere'):
        search([tmp_path / 'nowhere'])
    write_named(tmp_path / 'a', pair())
    with pytest.raises(ValueError, match="--only is 'b', which no scene .*; there are a"):
        search([tmp_path], only='b')
