# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What Middlebury's pictures of ground truth mean: grey levels per pixel of disparity."""
# group: {scene: (grey levels per pixel of disparity, disparities)}
MIDDLEBURY_FOLDERS = {
    'middv2': {'tsukuba': (16, 16), 'venus': (8, 20), 'teddy': (4, 60), 'cones': (4, 60)},
    'midd2001': {'bull': (8, 21), 'sawtooth': (8, 19)},
    'midd2006_third': {
        'Aloe': (3, 72), 'Baby1': (3, 47), 'Bowling1': (3, 78), 'Cloth1': (3, 59),
        'Cloth3': (3, 57), 'Flowerpots': (3, 62), 'Lampshade1': (3, 66), 'Midd1': (3, 70),
        'Rocks1': (3, 58), 'Wood1': (3, 73)},
    'midd2006_half': {'Cloth3': (2, 84)},
}
