# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""`fuzzy-stereo warm-up`: compile the kernels before they are needed, on all cores."""
import sys
import time

from fuzzy_stereo_ros.commands.parts import warm_matcher
from fuzzy_stereo_ros.matching.kernels.compiled import FOLDER
from fuzzy_stereo_ros.parameters.options import add_matcher_options, matcher_config

HELP = 'compile the kernels before they are needed'
DESCRIPTION = (
    'Compile the kernels that a matcher of these parameters needs, on all cores, and keep them\n'
    'for every later start: of the node, of the commands, of Python. Which they are depends on\n'
    'the profile, on more than 256 disparities, and on little else. What is there already is not\n'
    'compiled again.')
EXAMPLE = (
    'examples:\n'
    '  fuzzy-stereo warm-up\n'
    '  fuzzy-stereo warm-up --profile quality --disparities 128')


def add_arguments(parser):
    """Add the arguments of `warm-up`."""
    add_matcher_options(parser)


def run(arguments, stream, progress_stream=None):
    """
    Compile, and print to the stream where the kernels are kept.

    progress_stream: a text for the bar, standard error if None.
    Raises ValueError for bad parameters, and where no folder can keep what is compiled.
    """
    config = matcher_config(arguments)
    if FOLDER is None:
        raise ValueError('there is no folder to keep compiled kernels in; set NUMBA_CACHE_DIR to '
                         'one that can be written to')
    begun = time.monotonic()
    warm_matcher(config, progress_stream or sys.stderr, always=True)
    stream.write(f'the kernels of the profile {arguments.profile} are ready after '
                 f'{time.monotonic() - begun:.1f} s, kept in {FOLDER}\n')
