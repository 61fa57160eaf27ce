# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""`fuzzy-stereo warm-up`: compile the kernels before they are needed, on all cores."""
import time

from fuzzy_stereo_ros.matching import StereoMatcher, WARM_UP_SIZE
from fuzzy_stereo_ros.matching.kernels.compiled import FOLDER
from fuzzy_stereo_ros.parameters.options import add_matcher_options, matcher_config

ON_INTERRUPT = 'the kernels compiled so far are kept'
HELP = 'compile the kernels before they are needed'
DESCRIPTION = (
    'Compile the kernels of a matcher with these parameters on all cores, and keep them for\n'
    'later starts of the node, the commands and Python. They depend on the profile, on whether\n'
    'there are more than 256 disparities, and on little else. Existing ones are kept.')
EXAMPLE = (
    'examples:\n'
    '  fuzzy-stereo warm-up\n'
    '  fuzzy-stereo warm-up --profile quality --disparities 128')


def add_arguments(parser):
    add_matcher_options(parser)


def run(arguments, stream):
    """Compile the kernels and print where they are kept."""
    config = matcher_config(arguments)
    if FOLDER is None:
        raise ValueError('there is no folder for compiled kernels; set NUMBA_CACHE_DIR to a '
                         'writable one')
    begun = time.monotonic()
    StereoMatcher(config).warm_up(*WARM_UP_SIZE)
    stream.write(f'the kernels of the profile {arguments.profile} are ready after '
                 f'{time.monotonic() - begun:.1f} s, kept in {FOLDER}\n')
