"""The state of a node on /diagnostics: once a second, and at once when it changes."""
from __future__ import annotations

from collections.abc import Callable
import time

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node

from depth_person.nodes.monitor import Monitor

_PERIOD_S = 1.0
#: A fault that comes and goes with every frame is not published more often than this.
_SHORTEST_S = 0.1
_QUEUE = 10


class DiagnosticsOutput:
    """
    Publishes what a monitor says, whatever the state of the node's life.

    :param check: called once a second, before the state is published, to bring it up to date.
    """

    def __init__(self, node: Node, monitor: Monitor, *, check: Callable[[], None]) -> None:
        self._node = node
        self._monitor = monitor
        self._check = check
        self._published_s = float('-inf')
        self._publisher = node.create_publisher(DiagnosticArray, '/diagnostics', _QUEUE)
        # Wall time: with use_sim_time and no /clock there is something to report, too.
        wall = Clock(clock_type=ClockType.STEADY_TIME)
        node.create_timer(_PERIOD_S, self._on_period, clock=wall)
        self._late = node.create_timer(_SHORTEST_S, self._publish, clock=wall, autostart=False)
        # Any thread may see a change; the executor's publishes it.
        changed = node.create_guard_condition(self._on_change)
        monitor.on_change = changed.trigger

    def _on_period(self) -> None:
        self._check()
        self._publish()

    def _on_change(self) -> None:
        if time.monotonic() - self._published_s >= _SHORTEST_S:
            self._publish()
        elif self._late.is_canceled():
            self._late.reset()

    def _publish(self) -> None:
        self._late.cancel()
        self._published_s = time.monotonic()
        message = DiagnosticArray()
        message.header.stamp = self._node.get_clock().now().to_msg()
        name = self._node.get_fully_qualified_name().lstrip('/')
        message.status = [self._monitor.status(name)]
        self._publisher.publish(message)
