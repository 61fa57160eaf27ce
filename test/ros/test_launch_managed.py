# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The launch file with `managed:=true`: the node waits for its manager, and matches when told."""
import launched
from launched import launch_testing, PAIR
import pytest


@pytest.mark.launch_test
def generate_test_description():
    return launched.description(launched.small(managed='true'))


class TestTheLaunchedNode(launched.Launched):

    begun = ''

    def test_a_lifecycle_manager_brings_it_up(self):
        from lifecycle_manager import Manager
        manager = Manager(self.around)
        assert manager.state() == 'unconfigured'
        assert [manager.change(name) for name in ('configure', 'activate')] == [
            'inactive', 'active']
        self.connect()
        launched.check_disparity(self.around.first_match(*PAIR))


@launch_testing.post_shutdown_test()
class TestTheEnd(launched.Ended):
    pass
