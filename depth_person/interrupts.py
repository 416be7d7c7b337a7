"""Ctrl-C at a moment that can bear it."""
from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
import signal


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
