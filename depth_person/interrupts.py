"""Ctrl-C at a moment that can bear it."""
from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
import signal
import threading
from types import FrameType

SIGNALS = (signal.SIGINT, signal.SIGTERM)


@contextmanager
def deferred_interrupts() -> Iterator[None]:
    """
    Hold Ctrl-C and SIGTERM back until the block ends; the first that came is heard then.

    For imports: an extension module that is interrupted while it loads raises an ImportError of
    its own instead of KeyboardInterrupt. And for what must not be left half done.
    """
    came: list[int] = []
    previous = {number: signal.signal(number, lambda number, _: came.append(number))
                for number in SIGNALS}
    try:
        yield
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)
    if came:
        signal.raise_signal(came[0])


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

    previous = {number: signal.signal(number, on_signal) for number in SIGNALS}
    try:
        yield came
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)
