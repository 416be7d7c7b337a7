"""Threads beside the executor, and how frames are handed to them."""
from __future__ import annotations

from collections.abc import Callable
import threading
from typing import Generic, TypeVar

Item = TypeVar('Item')


class Mailbox(Generic[Item]):
    """
    Holds the newest item until it is taken; older ones are dropped.

    A longer queue in front of a slow stage would add latency and nothing else.
    """

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._item: Item | None = None
        self._taker_waits = False
        self._closed = False

    def put(self, item: Item) -> bool:
        """Leave an item, unless closed; return whether an older one was dropped for it."""
        with self._changed:
            if self._closed:
                return False
            dropped = self._item is not None
            self._item = item
            self._changed.notify()
        return dropped

    def take(self) -> Item | None:
        """Return the newest item as soon as there is one; None once the mailbox is closed."""
        with self._changed:
            self._taker_waits = True
            self._changed.wait_for(lambda: self._closed or self._item is not None)
            self._taker_waits = False
            item, self._item = self._item, None
            return item

    def close(self) -> None:
        """Drop what is in it, and wake whoever waits, with nothing."""
        with self._changed:
            self._closed = True
            self._item = None
            self._changed.notify_all()

    def open(self) -> None:
        """Take items again after having been closed."""
        with self._changed:
            self._closed = False

    @property
    def idle(self) -> bool:
        """Whether every item has been taken and dealt with: the taker is back for another."""
        with self._changed:
            return self._item is None and self._taker_waits


class Worker:
    """
    A thread that is told to stop, and whose failure is not lost.

    :param target: called once in the thread, with the event `stopping`; returns when it is set.
    """

    def __init__(self, name: str, target: Callable[[threading.Event], None]) -> None:
        self.name = name
        self.stopping = threading.Event()
        self.failure: BaseException | None = None
        self._target = target
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def stop(self, timeout_s: float = 2.0) -> bool:
        """Tell the thread to stop and wait for it; return whether it has ended."""
        self.stopping.set()
        if self._thread.is_alive():
            self._thread.join(timeout_s)
        return not self._thread.is_alive()

    def _run(self) -> None:
        try:
            self._target(self.stopping)
        except BaseException as failure:
            self.failure = failure
