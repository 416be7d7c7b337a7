"""What arrives on a subscription, and what does not."""
from __future__ import annotations

import time

from depth_person.nodes.monitor import Level, Monitor

#: A topic that is silent for longer, seconds, is reported.
_SILENCE_S = 2.0
#: More than this share of messages lost in transport is reported.
_LOSS = 0.1


class Traffic:
    """
    Counts the messages of one topic, or what is handed over in memory.

    :param topic: its full name, or of what it takes the place.
    :param optional: whether silence is not reported.
    :param shared: whether the topic may well have several publishers.
    :ivar crowded: what is wrong when it has more than it should; empty while nothing is.
    """

    def __init__(
        self, topic: str, monitor: Monitor, *, optional: bool = False, shared: bool = False,
    ) -> None:
        self.crowded = ''
        self._shared = shared
        self._topic = topic
        self._optional = optional
        self._monitor = monitor
        self._newest_s = time.monotonic()
        self._received = 0
        self._lost = 0

    def receive(self) -> None:
        """Note that a message has come."""
        self._newest_s = time.monotonic()
        self._received += 1

    def lose(self, number: int) -> None:
        """Note that messages were lost in transport, or for want of room in the queue."""
        self._lost += number
        self._monitor.count(f'lost on {self._topic}', number)

    def restart(self) -> None:
        """Count silence from now on."""
        self._newest_s = time.monotonic()

    def check(self, *, publishers: int | None = None) -> None:
        """
        Report silence and losses since the last call.

        :param publishers: how many the topic has; None where there is no topic.
        """
        silent_s = time.monotonic() - self._newest_s
        received, lost = self._received, self._lost
        self._received = self._lost = 0
        if silent_s > _SILENCE_S and not self._optional:
            self._monitor.fault(
                self._key('silence'), Level.ERROR,
                f'nothing came from {self._topic} for {silent_s:.0f} s' if publishers is None else
                f'no message on {self._topic} for {silent_s:.0f} s; it has {publishers} '
                'publishers')
        else:
            self._monitor.clear(self._key('silence'))
        if lost > _LOSS * received:
            self._monitor.fault(
                self._key('losses'), Level.WARN,
                f'messages get lost on {self._topic}; if its publisher is reliable, set the '
                f'parameter qos_overrides.{self._topic}.subscription.reliability to reliable')
        else:
            self._monitor.clear(self._key('losses'))

        self._count_publishers(publishers or 0)

    def _count_publishers(self, number: int) -> None:
        self.crowded = (
            f'{number} publishers send on {self._topic}, where there should be one; what they '
            'send is mixed up. End the others, or remap them'
            if number > 1 and not self._shared else '')
        if self.crowded:
            self._monitor.fault(self._key('publishers'), Level.WARN, self.crowded)
        else:
            self._monitor.clear(self._key('publishers'))

    def forget(self) -> None:
        """Take back what was reported; the subscription has been given up."""
        self._monitor.clear(self._key('publishers'))
        self._monitor.clear(self._key('silence'))
        self._monitor.clear(self._key('losses'))

    def _key(self, kind: str) -> str:
        return f'{kind} on {self._topic}'
