# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Middlebury's data sets, recognised by what a folder holds.

| sets | pair | truth of the left and of the right image | grey levels per pixel |
|---|---|---|---|
| 2001, 2003 ("v2") | im2, im6 | disp2, disp6 | by the scene |
| 2005, 2006 | view1, view5 | disp1, disp5 | by the size |
| 2014 and later, also ETH3D's | im0, im1 | disp0GT.pfm or disp0.pfm, disp1.pfm | pixels |
"""
from fuzzy_stereo_ros.evaluation.found import FoundScene
from fuzzy_stereo_ros.evaluation.grey_scales import scale_of
from fuzzy_stereo_ros.evaluation.ground_truth import MIDDLEBURY, WHOLE_PIXEL_TRUTH
from fuzzy_stereo_ros.evaluation.pair_files import (
    complete, first_of, masks_of, NONOCC, PairFiles, picture_of, told_disparities)

V2, V3 = 'Middlebury v2', 'Middlebury 2014'
# left, right, truth of the left and of the right image
GREY_SETS = ('im2', 'im6', 'disp2', 'disp6'), ('view1', 'view5', 'disp1', 'disp5')
TRUTHS_OF_2014 = 'disp0GT.pfm', 'disp0.pfm'


def find_grey(folder, truth_scale=None):
    """Return the scene of a folder with a truth in grey levels, as a list; None if it is none."""
    for names in GREY_SETS:
        left, right, truth, right_truth = (picture_of(folder, name) for name in names)
        wanted = [folder / f'{name}.png' for name in names[:3]]
        if not complete(V2, left, right, truth, wanted):
            continue
        scale = scale_of(folder, left, truth_scale)
        return [FoundScene(folder, V2, scale.disparities, scale.told_by, files=PairFiles(
            left, right, MIDDLEBURY, truth, scale.levels, right_truth=right_truth,
            masks=masks_of(folder),
            whole_pixel=folder.resolve().name.lower() in WHOLE_PIXEL_TRUTH))]
    return None


def find_floating(folder, truth_scale=None):
    """Return the scene of a folder with a truth in pixels, as a list; None if it is none."""
    left, right = picture_of(folder, 'im0'), picture_of(folder, 'im1')
    truth = first_of(folder, TRUTHS_OF_2014)
    wanted = [folder / 'im0.png', folder / 'im1.png', folder / TRUTHS_OF_2014[0]]
    if not complete(V3, left, right, truth, wanted):
        return None
    mask = picture_of(folder, 'mask0nocc')
    return [FoundScene(folder, V3, *told_disparities(folder), files=PairFiles(
        left, right, MIDDLEBURY, truth, right_truth=first_of(folder, ['disp1.pfm']),
        masks={} if mask is None else {NONOCC: mask}))]
