"""Ctrl-C at a moment that can bear it."""
from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
import signal
import threading
from types import FrameType


@contextmanager
def deferred_interrupts() -> Iterator[None]:
    """
    Hold Ctrl-C back until the block ends.

    For imports: an extension module that is interrupted while it loads raises an ImportError of
    its own instead of KeyboardInterrupt.

    :raises KeyboardInterrupt: at the end of the block, if Ctrl-C came.
    """
    came: list[int] = []
    previous = signal.signal(signal.SIGINT, lambda number, _: came.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, previous)
    if came:
        raise KeyboardInterrupt


@contextmanager
def noted_interrupts() -> Iterator[threading.Event]:
    """
    Turn the first SIGINT or SIGTERM into an event; a second one ends the process at once.

    For work that ends in order once it has looked at the event.
    """
    came = threading.Event()

    def on_signal(number: int, _: FrameType | None) -> None:
        came.set()
        signal.signal(number, signal.SIG_DFL)

    previous = {number: signal.signal(number, on_signal)
                for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield came
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)
