# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Which of the processors that wheels bring kernels for this machine has."""
import platform

from fuzzy_stereo_ros.matching.kernels.compiled import LEVELS
from numba.core.codegen import get_host_cpu_features


def has_level(name):
    """Return whether this processor has all that a level of LEVELS needs."""
    features = get_host_cpu_features().replace('+', '').split(',')
    return platform.machine() == 'x86_64' and LEVELS[name] <= {*features}
