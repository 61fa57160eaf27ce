# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Two rigs of one file in a process each: every node answers its own cameras."""
import launched
from launched import launch_testing
import launched_rigs
import pytest


@pytest.mark.launch_test
def generate_test_description():
    return launched_rigs.rigs()


class TestTheLaunchedNodes(launched_rigs.TwoRigs):
    pass


@launch_testing.post_shutdown_test()
class TestTheEnd(launched.Ended):

    def test_each_rig_had_a_process(self, proc_info):
        assert len(proc_info.processes()) == 2
