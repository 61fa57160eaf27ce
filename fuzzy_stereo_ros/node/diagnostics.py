# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The node's place in /diagnostics: a level, a sentence and values, once a second."""
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from fuzzy_stereo_ros.reports import Rates, verdict


class Diagnosis:
    """Publishes what the node is like."""

    def __init__(self, node, now):
        """Advertise; now: s, from when rates are counted."""
        self._node, self._rates = node, Rates(now)
        self._publisher = node.create_publisher(DiagnosticArray, '/diagnostics', 1)
        self.values = {}

    def publish(self, now, counts, values, ready, subscribed, quiet):
        """
        Publish what is true at a time in s; ready, subscribed, quiet: as of `verdict`.

        counts: {key: number} as of `counts_of`; values: {key: text}, what else there is.
        """
        rates = self._rates.since(now, counts)
        level, sentence = verdict(ready, subscribed, quiet, rates)
        self.values = {**{key: str(count) for key, count in counts.items()},
                       'input rate': f"{rates['pairs synchronised']:.1f} pairs/s",
                       'output rate': f"{rates['pairs matched']:.1f} pairs/s", **values}
        name = self._node.get_fully_qualified_name()
        message = DiagnosticArray(status=[DiagnosticStatus(
            level=getattr(DiagnosticStatus, level), message=sentence,
            name=f'{name}: stereo matching', hardware_id=name,
            values=[KeyValue(key=key, value=value) for key, value in self.values.items()])])
        message.header.stamp = self._node.get_clock().now().to_msg()
        self._publisher.publish(message)
