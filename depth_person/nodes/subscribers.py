"""What publishers wait for of their subscribers."""
from __future__ import annotations

from collections.abc import Callable, Iterable
import threading
import time

from rclpy.duration import Duration
from rclpy.publisher import Publisher

#: Nodes find each other one by one, up to 1.4 s apart where several start at once.
_SETTLE_S = 2.0
_POLL_S = 0.05


def wait_for_subscribers(count: Callable[[], int], stopping: threading.Event) -> None:
    """
    Return when someone subscribes, and for a while nobody else has come.

    :param count: returns how many subscribe.
    :param stopping: ends the wait.
    """
    number, since_s = 0, time.monotonic()
    while not stopping.wait(_POLL_S):
        before, number = number, count()
        if number != before:
            since_s = time.monotonic()
        elif number and time.monotonic() - since_s > _SETTLE_S:
            return


def wait_for_delivery(publishers: Iterable[Publisher], *, timeout_s: float) -> None:
    """Return when reliable subscribers have all that was published, or time is over for all."""
    deadline = time.monotonic() + timeout_s
    for publisher in publishers:
        left_s = max(deadline - time.monotonic(), 0.0)
        publisher.wait_for_all_acked(Duration(seconds=left_s))
