"""The time of recordings that are played."""
from __future__ import annotations

from collections.abc import Callable
import threading
import time

#: How often /clock is published between two messages.
CLOCK_PERIOD_S = 0.025
#: Who is later than this, seconds, goes on from now instead of catching up.
LATEST_S = 1.0


class Pacer:
    """
    Holds what was recorded back until as much time has passed as between its stamps.

    All waits are for times counted from the first stamp, so that no error adds up.

    :param stopping: ends every wait.
    :param on_clock: told the stamp that the recording has come to, between its messages, too.
    :param rate: how much faster than recorded.
    :param clock_period_s: the longest time without a call of on_clock.
    :param latest_s: who is later than this goes on from now instead of catching up.
    :ivar late_s: how much later than due the last wait ended.
    :ivar lost_s: how much later than by the first stamp all is, for want of catching up.
    """

    def __init__(
        self, stopping: threading.Event, on_clock: Callable[[int], None] | None, *,
        rate: float = 1.0, clock_period_s: float = CLOCK_PERIOD_S, latest_s: float = LATEST_S,
    ) -> None:
        self._stopping = stopping
        self._on_clock = on_clock
        self._rate = rate
        self._clock_period_s = clock_period_s
        self._latest_s = latest_s
        self._start_s = 0.0
        self._start_ns: int | None = None
        self._last_ns = 0
        self.late_s = self.lost_s = 0.0

    def wait(self, stamp_ns: int) -> None:
        """Return when what has this stamp is due; stamps that jump back start anew."""
        if self._start_ns is None or stamp_ns < self._last_ns:
            self._begin(stamp_ns)
        self._last_ns = stamp_ns
        while (left_s := self._left_s(stamp_ns)) > 0 and not self._stopping.is_set():
            if self._on_clock is None:
                self._stopping.wait(left_s)
            else:
                self._on_clock(stamp_ns - int(left_s * self._rate * 1e9))
                self._stopping.wait(min(left_s, self._clock_period_s))
        self.late_s = max(-left_s, 0.0)
        if self.late_s > self._latest_s:
            self.lost_s += self.late_s
            self._begin(stamp_ns)
        if self._on_clock is not None:
            self._on_clock(stamp_ns)

    def _begin(self, stamp_ns: int) -> None:
        self._start_s, self._start_ns = time.monotonic(), stamp_ns

    def _left_s(self, stamp_ns: int) -> float:
        assert self._start_ns is not None
        passed_s = (stamp_ns - self._start_ns) * 1e-9 / self._rate
        return self._start_s + passed_s - time.monotonic()
