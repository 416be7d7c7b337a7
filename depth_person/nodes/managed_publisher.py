"""A publisher that a lifecycle node can silence from one moment to the next."""
from __future__ import annotations

import threading
from typing import Any

from rclpy.lifecycle import LifecyclePublisher, LifecycleState
from rclpy.lifecycle import TransitionCallbackReturn as Outcome


class ManagedPublisher(LifecyclePublisher):
    """A publisher that is silent for good once deactivation returns, whoever publishes."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self._sending = threading.Lock()

    def publish(self, msg: Any) -> None:
        """Publish, if active."""
        with self._sending:
            super().publish(msg)

    def on_deactivate(self, state: LifecycleState) -> Outcome:
        """Wait for the message that is on its way, then be silent."""
        with self._sending:
            return super().on_deactivate(state)
