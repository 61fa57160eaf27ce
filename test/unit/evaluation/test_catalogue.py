# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Scenes are recognised by what their folders hold, and read as their data sets mean them."""
from itertools import product
from pathlib import Path

from fuzzy_stereo_ros.evaluation.catalogue import search
from fuzzy_stereo_ros.evaluation.ground_truth import (
    agreeing, KITTI, MIDDLEBURY, seen_by_both, warped_to_right)
from fuzzy_stereo_ros.pairs.disparity_files import write_disparity
from fuzzy_stereo_ros.pairs.image_files import write_image
import numpy as np
import pytest
from written_scenes import (
    frames, grey_truth, in_kitti_steps, pair, write_2014, write_frames, write_images,
    write_kitti, write_named)

# Where files are, {} stands for a name; the names of both images, of the truth, and of that of
# the right image or, of KITTI, of what both cameras see.
LAYOUTS = [
    ('venus/{}', 'im2 im6 disp2 disp6'), ('Moebius/{}', 'view1 view5 disp1 disp5'),
    ('scene/{}', 'im0 im1 disp0GT disp1'), ('scene/{}', 'im0 im1 disp0 disp1'),
    ('training/{}/000000_10', 'image_2 image_3 disp_occ_0 disp_noc_0'),
    ('training/{}/000000_10', 'image_0 image_1 disp_occ disp_noc'),
    ('training/{}/000000_10', 'colored_0 colored_1 disp_occ disp_noc'),
    ('scene/{}', 'left right groundtruth'), ('scene/{}', 'left right disp_occ_0 disp_noc_0'),
    ('scene/{}_07', 'left right groundtruth'), ('scene/{}/0007', 'left right truth')]
FORMS = 'grey', '.png', '.pfm', '.npy', '.npz'
NONOCC = 'nonocc', 'nonocc_derived', 'visible', 'mask0nocc'


def write_truth(path, truth, form, scale):
    """Write a truth in one of FORMS; return it as it is read."""
    if form == 'grey':
        levels, truth = grey_truth(truth, scale)
        write_image(f'{path}.png', np.dstack([levels] * 3) if scale % 2 else levels)
    elif form == '.npz':
        np.savez(f'{path}.npz', truth)
    else:
        write_disparity(f'{path}{form}', truth)
    return in_kitti_steps(truth) if form == '.png' else truth


@pytest.mark.parametrize('place, names, masked, second, told', [
    (*layout, *there) for number, layout in enumerate(LAYOUTS)
    for there in product([False, True], repeat=3) if (sum(there) + number) % 2])
def test_a_scene_is_recognised_and_read_as_its_data_set_means_it(
        tmp_path, place, names, masked, second, told):
    """Also beside the companions of its files that macOS writes on other disks."""
    def path(kind):
        found = tmp_path / place.format(kind)
        found.parent.mkdir(parents=True, exist_ok=True)
        return found

    random, made = np.random.default_rng([masked, second, told, *names.encode()]), pair()
    left, right, whole, *others = names.split()
    kitti, suffix = 'disp_occ' in whole, random.choice(['.png', '.ppm'])
    scale, form = int(random.integers(3, 17)), '.png' if kitti else random.choice(FORMS)
    for name, image in ((left, made.left), (right, made.right)):
        write_image(f'{path(name)}{suffix}', image)
    truth, masks = made.truth, {}
    if kitti and second:
        visible = np.where(made.visible, truth, np.nan)
        truth = write_truth(path(others[0]), visible, form, scale)
        masks['nonocc'] = made.visible
    if not (kitti and second and masked):       # else there is only what both cameras see
        truth = write_truth(path(whole), made.truth, form, scale)
        masks['all'] = np.isfinite(truth)
    if not kitti and masked:
        some = made.visible & (np.arange(truth.shape[1]) % 7 < 3)
        masks = {'nonocc': made.visible, 'all': made.visible | some, 'disc': some}
        for name, mask in zip((random.choice(NONOCC), 'all', 'disc'), masks.values()):
            write_image(f'{path(name)}.png', np.where(mask, 255, 128).astype(np.uint8))
    elif not kitti and second and others:
        of_right = warped_to_right(truth)
        of_right[:, 40:] = np.nan
        masks['nonocc'] = agreeing(truth, write_truth(path(others[0]), of_right, form, scale))
    elif not kitti:
        masks['nonocc'] = seen_by_both(truth)
    explained = told and form == 'grey' and place.endswith('/{}')
    wanted = (16, 'info.txt') if explained else (29, 'calib.txt') if told else (None, '')
    if told:
        (tmp_path / place.split('/')[0] / wanted[1]).write_text(
            f'{scale} 15' if explained else 'doffs=0\nndisp=29\nvmin=2\n')
    for file in [*tmp_path.rglob('*.*')]:
        file.with_name(f'._{file.name}').write_bytes(b'\0\5\x16\7')
    if form == 'grey' and not explained:
        with pytest.raises(ValueError, match='has 8 bits and no known scale: give --truth-scale'):
            search([tmp_path])
    found = search([tmp_path], None if form != 'grey' else scale + explained)
    (scene,) = found.scenes
    assert not found.sequences and not found.skipped
    assert scene.name == (Path(place).name.strip('{}_') or Path(place).parent.name)
    assert scene.family == (KITTI if kitti else MIDDLEBURY)
    assert (scene.disparities, scene.source) == wanted
    known = scene.read()
    np.testing.assert_array_equal(known.truth, truth)
    assert list(known.masks) == [name for name in ('nonocc', 'all', 'disc') if name in masks]
    for name, mask in masks.items():
        np.testing.assert_array_equal(known.masks[name], mask, err_msg=name)
    assert known.left.shape[:2] == known.right.shape[:2] == known.truth.shape


@pytest.mark.parametrize('ndisp', [0, 4097, 10**30])
def test_a_number_of_disparities_that_cannot_be_searched_is_rejected_by_file(tmp_path, ndisp):
    write_2014(tmp_path / 'scene', pair(), ndisp=ndisp)
    with pytest.raises(ValueError, match=f'scene/calib.txt has ndisp={ndisp}: disparities is '
                       f'{ndisp}; allowed are whole numbers from 1 to 4096; remove the line or'):
        search([tmp_path])


def test_all_files_of_kitti_are_found_and_the_frames_before_make_a_sequence(tmp_path):
    several = frames(3)
    for number, made in zip((8, 9, 10, 11), [*several, several[0]]):
        write_kitti(tmp_path, made, f'000003_{number:02}.png', known=number == 10)
    write_kitti(tmp_path, pair(), '000001_10.png')
    found = search([tmp_path])
    assert [scene.name for scene in found.scenes] == ['000001_10', '000003_10']
    (sequence,) = found.sequences
    assert (sequence.name, list(sequence.files)) == ('000003', ['08', '09', '10', '11'])
    assert [files.truth is not None for files in sequence.files.values()] == [
        False, False, True, False]


@pytest.mark.parametrize('in_folders', [False, True])
def test_numbered_frames_are_a_sequence_in_order_and_those_with_a_truth_are_scenes(
        tmp_path, in_folders):
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
    files.right.unlink()
    with pytest.raises(ValueError, match=f'{files.right} is missing; {files.left} has no right'):
        search([tmp_path])


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


SMALL = np.zeros((5, 6), np.uint8)


@pytest.mark.parametrize('spoil, reason', [
    (lambda folder: (folder / 'im1.png').unlink(),
     'im1.png is missing; .*im0.png has no right image'),
    (lambda folder: write_image(folder / 'mask0nocc.png', SMALL),
     'mask0nocc.png is 6x5, the images are 72x40'),
    (lambda folder: write_disparity(folder / 'disp0GT.pfm', SMALL.astype(np.float32)),
     'disp0GT.pfm is 6x5, the images are 72x40'),
    (lambda folder: (folder / 'disp0GT.pfm').write_bytes(b'no such thing'),
     'disp0GT.pfm is not a PFM file')])
def test_a_spoiled_scene_is_rejected_with_the_name_of_its_file(spoil, reason, tmp_path):
    write_2014(tmp_path, pair(), ndisp=16)
    spoil(tmp_path)
    with pytest.raises(ValueError, match=reason):
        search([tmp_path]).scenes[0].read()


def test_a_missing_or_empty_folder_and_a_word_that_no_name_has_are_rejected(tmp_path):
    with pytest.raises(ValueError, match='there is no folder .*nowhere'):
        search([tmp_path / 'nowhere'])
    with pytest.raises(ValueError, match='there is no scene below .*; known layouts are Middleb'):
        search([tmp_path])
    write_named(tmp_path / 'a', pair())
    with pytest.raises(ValueError, match="--only is 'b', which no scene .*; there are a"):
        search([tmp_path], only='b')
