# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Made scenes, written in the layouts of the public data sets."""
from fuzzy_stereo_ros.evaluation.ground_truth import warped_to_right
from fuzzy_stereo_ros.pairs.disparity_files import write_disparity
from fuzzy_stereo_ros.pairs.image_files import write_image
from fuzzy_stereo_ros.synthetic.scenes import make_pair, make_sequence
import numpy as np

ROWS, COLUMNS, DISPARITIES = 40, 72, 16
HOLE = np.s_[3:6, 50:60]        # where the truth is not known


def pair(seed=1):
    """Return a `ScenePair` whose truth has a hole; visible where it counts."""
    return with_hole(make_pair(ROWS, COLUMNS, DISPARITIES, seed, colour=True, noise=1))


def frames(count, seed=1):
    """Return `ScenePair`s of a noisy sequence that hardly moves."""
    return [with_hole(made) for made in make_sequence(
        ROWS, COLUMNS, DISPARITIES, count, seed, noise=6)]


def with_hole(made):
    made.truth[HOLE] = np.nan
    made.visible[HOLE] = False
    return made


def grey_truth(truth, scale):
    """Return a truth as grey levels, 0 = unknown, and as it is read from them."""
    levels = np.where(np.isfinite(truth), np.clip(np.rint(truth * scale), 1, 255), 0)
    read = np.where(levels > 0, levels / np.float32(scale), np.nan)
    return levels.astype(np.uint8), read.astype(np.float32)


def write_images(folder, made, left, right):
    """Write the two images under names with a suffix."""
    for name, image in ((left, made.left), (right, made.right)):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        write_image(folder / name, image)


def write_masks(folder, made, names=('nonocc', 'all', 'disc')):
    """Write masks of 0, 128 and 255; return {name: which are 255}."""
    known = np.isfinite(made.truth)
    columns = np.arange(made.truth.shape[1])
    whole = {'nonocc': made.visible, 'all': known & (columns > 2),
             'disc': known & (columns % 7 < 3)}
    for name in names:
        write_image(folder / f'{name}.png', np.where(
            whole[name], 255, np.where(known, 128, 0)).astype(np.uint8))
    return {name: whole[name] for name in names}


def write_v2(folder, made, scale):
    """Write the layout of 2001 and 2003; return the truth as it is read."""
    write_images(folder, made, 'im2.png', 'im6.png')
    levels, truth = grey_truth(made.truth, scale)
    write_image(folder / 'disp2.png', levels)
    write_image(folder / 'disp6.png', grey_truth(warped_to_right(truth), scale)[0])
    return truth


def write_2014(folder, made, ndisp):
    """Write the layout of 2014; ndisp: what calib.txt says."""
    write_images(folder, made, 'im0.png', 'im1.png')
    write_disparity(folder / 'disp0GT.pfm', made.truth)
    (folder / 'calib.txt').write_text(
        f'cam0=[1 0 2; 0 1 2; 0 0 1]\ndoffs=0\nbaseline=100\nndisp={ndisp}\nvmin=3\n')


def write_kitti(folder, made, name, known=True):
    """Write a frame into KITTI's structure of 2015; known: with its truths."""
    write_images(folder, made, f'image_2/{name}', f'image_3/{name}')
    for kind, which in (('disp_occ_0', True), ('disp_noc_0', made.visible)) if known else ():
        (folder / kind).mkdir(exist_ok=True)
        write_disparity(folder / kind / name, np.where(which, made.truth, np.nan))


def in_kitti_steps(truth):
    """Return a truth as KITTI's PNG files give it back."""
    levels = np.clip(np.rint(truth.astype(np.float64) * 256), 1, 65535)
    return (levels / 256).astype(np.float32)


def write_named(folder, made):
    """Write left.png, right.png and a truth."""
    write_images(folder, made, 'left.png', 'right.png')
    write_disparity(folder / 'groundtruth.pfm', made.truth)


def write_frames(folder, several, known=(), in_folders=False):
    """Write frames numbered from 7 on, known: with a truth; in one folder without zeros."""
    for number, made in enumerate(several, start=7):
        place = f'{{}}/{number:04}' if in_folders else f'{{}}_{number}'
        write_images(folder, made, *(f'{place.format(side)}.png' for side in ('left', 'right')))
        if number in known:
            truth = folder / f"{place.format('groundtruth')}.npy"
            truth.parent.mkdir(exist_ok=True)
            write_disparity(truth, made.truth)
