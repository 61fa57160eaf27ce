# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Why no pair may come, and what to do."""
from dataclasses import dataclass
import os

# By either Fast DDS is told of a file of profiles; without one it loses large messages.
FAST_DDS_VARIABLES = ('FASTRTPS_DEFAULT_PROFILES_FILE', 'FASTDDS_DEFAULT_PROFILES_FILE')


def large_messages_pass():
    """Return whether Fast DDS has a file of profiles."""
    return any(os.environ.get(name) for name in FAST_DDS_VARIABLES)


@dataclass(frozen=True)
class TopicState:
    """
    What is known of an input topic: messages received, publishers now, incompatible QoS.

    held: whether a message from before is good for every pair.
    """

    name: str
    received: int
    publishers: int
    incompatible: str = ''
    held: bool = False


def no_pair_report(seconds, topics, difference, approximate):
    """
    Return one sentence that says why no pair may come and what to do.

    seconds: without a pair. topics: TopicState of each input, the counts since the last pair.
    difference: ns between the latest stamps of two topics at most, or None.
    approximate: whether stamps may differ.
    """
    counts = ', '.join(f'{topic.name} {topic.received}' for topic in topics)
    report = f'no stereo pair for {seconds:.0f} s; messages since then: {counts}'
    if difference is not None:
        report += f'; the latest stamps differ by up to {difference / 1e6:.3f} ms'
    silent = [topic for topic in topics if not (topic.received or topic.held)]
    remedies = [f'{topic.name} is offered with an incompatible QoS ({topic.incompatible}): set '
                f'qos_overrides.{topic.name}.subscription.{topic.incompatible}'
                for topic in silent if topic.incompatible and topic.publishers]
    unpublished = [topic.name for topic in silent if not topic.publishers]
    if unpublished:
        remedies.append(f"nobody publishes {', '.join(unpublished)}: start the camera driver, or "
                        'remap the topic')
    lost = [topic.name for topic in silent if topic.publishers and not topic.incompatible]
    if lost:
        hint = ('' if large_messages_pass() else
                ', and Fast DDS loses large best-effort images unless both sides run with '
                f"{FAST_DDS_VARIABLES[0]} set to this package's config/fastdds.xml")
        remedies.append(f"nothing arrives from the publishers of {', '.join(lost)}: they may be "
                        f'silent{hint}')
    if not silent:
        remedies.append(
            'stamps differ by more than approximate_sync_tolerance_seconds, or queue_size is too '
            'small' if approximate else
            'no stamp came on all four topics: set approximate_sync if the cameras do not stamp '
            'alike, or a larger queue_size')
    return '; '.join([report, *remedies])
