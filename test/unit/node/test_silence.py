# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The report when no pair comes: what came, and what to do."""
from fuzzy_stereo_ros.node.watchdog import FAST_DDS_VARIABLES, no_pair_report, TopicState
import pytest

NAMES = ('/left/image_rect', '/left/camera_info', '/right/image_rect', '/right/camera_info')


def states(**changes):
    """Return four topics with messages and a publisher; changes by place, as in at2={...}."""
    return [TopicState(**{'name': name, 'received': 9, 'publishers': 1,
                          **changes.get(f'at{place}', {})}) for place, name in enumerate(NAMES)]


@pytest.mark.parametrize('topics, options, expected', [
    (states(at1={'received': 0, 'publishers': 0}), {},
     'nobody publishes /left/camera_info: start the camera driver, or remap the topic'),
    (states(at0={'received': 0, 'incompatible': 'reliability'}), {},
     '/left/image_rect is offered with an incompatible QoS (reliability): set '
     'qos_overrides./left/image_rect.subscription.reliability'),
    (states(at0={'incompatible': 'reliability'}), {},
     'no stamp came on all four topics: set approximate_sync if the cameras do not stamp alike, '
     'or a larger queue_size'),
    (states(at0={'received': 0, 'publishers': 0, 'incompatible': 'reliability'}), {'profile': 0},
     'nobody publishes /left/image_rect: start the camera driver, or remap the topic'),
    (states(at2={'received': 0}), {},
     'nothing arrives from the publishers of /right/image_rect: they may be silent, and Fast DDS '
     'loses large best-effort images unless both sides run with FASTRTPS_DEFAULT_PROFILES_FILE '
     "set to this package's config/fastdds.xml"),
    (states(at2={'received': 0}), {'profile': 1},
     'nothing arrives from the publishers of /right/image_rect: they may be silent'),
    (states(at1={'received': 0, 'publishers': 0, 'held': True},
            at3={'received': 0, 'held': True}), {},
     'no stamp came on all four topics: set approximate_sync if the cameras do not stamp alike, '
     'or a larger queue_size'),
    (states(), {},
     'no stamp came on all four topics: set approximate_sync if the cameras do not stamp alike, '
     'or a larger queue_size'),
    (states(), {'approximate': True},
     'stamps differ by more than approximate_sync_tolerance_seconds, or queue_size is too small'),
])
def test_the_report_ends_with_what_to_do(topics, options, expected, monkeypatch):
    for name in FAST_DDS_VARIABLES:
        monkeypatch.delenv(name, raising=False)
    if 'profile' in options:
        monkeypatch.setenv(FAST_DDS_VARIABLES[options['profile']], 'a file')
    report = no_pair_report(5.4, topics, 1_500_000, options.get('approximate', False))
    counts = ', '.join(f'{topic.name} {topic.received}' for topic in topics)
    assert report == (f'no stereo pair for 5 s; messages since then: {counts}; the latest stamps '
                      f'differ by up to 1.500 ms; {expected}')
