# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What this runs on, as far as it may decide about the bits of a result."""
from importlib.metadata import PackageNotFoundError
import platform

import cv2
import fuzzy_stereo_ros
import numba
from numba.core.registry import cpu_target
import numpy as np


def package_version():
    """Return the version of this package, 'unknown' in a source tree that was never installed."""
    try:
        return fuzzy_stereo_ros.__version__
    except PackageNotFoundError:
        return 'unknown'


def versions():
    """
    Return {what: str}: versions, platform, and the processor that numba compiles for.

    processor_features: names of instruction sets, separated by blanks.
    """
    _, processor, features = cpu_target.target_context.codegen().magic_tuple()
    return {
        'fuzzy_stereo_ros': package_version(),
        'python': platform.python_version(),
        'numpy': np.__version__,
        'numba': numba.__version__,
        'opencv': cv2.__version__,
        'platform': _platform(),
        'processor': processor,
        'processor_features': ' '.join(
            name[1:] for name in features.split(',') if name.startswith('+')),
    }


def _platform():
    """Return what platform.platform() says, which starts a process for a part it leaves out."""
    name = f'{platform.system()}-{platform.release()}-{platform.machine()}'
    library = ''.join(platform.libc_ver())
    return f'{name}-with-{library}' if library else name
