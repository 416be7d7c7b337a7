"""Stages that work at the same time, each in a thread of its own."""
from __future__ import annotations

from collections.abc import Generator, Iterable, Iterator
from contextlib import contextmanager
import queue
import sys
import threading
from typing import TypeVar

T = TypeVar('T')

#: How often a thread with nowhere to put its item looks whether it is still wanted.
_POLL_S = 0.1
#: How long a stage may go on in the interpreter while another waits for it, seconds.
_TURN_S = 1e-4


class _End:
    """What comes behind the last item."""

    def __init__(self, error: BaseException | None) -> None:
        self.error = error


def ahead(items: Iterable[T], *, depth: int) -> Generator[T, None, None]:
    """
    Yield items in their order while a thread gets up to so many of the next ones.

    Closing the generator ends the thread, after the item that it is at. What the items raise is
    raised here, in its turn.

    :param depth: items that may wait; more of them cost memory.
    """
    waiting: queue.Queue[T | _End] = queue.Queue(depth)
    unwanted = threading.Event()
    thread = threading.Thread(target=_fill, args=(waiting, items, unwanted), name='ahead')
    thread.start()
    try:
        while not isinstance(item := waiting.get(), _End):
            yield item
    finally:
        unwanted.set()
        thread.join()
    if item.error is not None:
        raise item.error


@contextmanager
def short_turns() -> Iterator[None]:
    """
    Let threads leave the interpreter to each other sooner while the block runs.

    A network computes outside of it, on all cores, and comes back for a moment between two parts.
    It would wait there for up to five milliseconds, cores idle, whenever another stage is at work.
    """
    usual = sys.getswitchinterval()
    sys.setswitchinterval(_TURN_S)
    try:
        yield
    finally:
        sys.setswitchinterval(usual)


def _fill(
    waiting: queue.Queue[T | _End], items: Iterable[T], unwanted: threading.Event,
) -> None:
    error: BaseException | None = None
    try:
        for item in items:
            if not _put(waiting, item, unwanted):
                break
    except BaseException as raised:  # whatever it is, it belongs to who takes the items
        error = raised
    finally:
        if isinstance(items, Generator):
            items.close()
    _put(waiting, _End(error), unwanted)


def _put(
    waiting: queue.Queue[T | _End], item: T | _End, unwanted: threading.Event,
) -> bool:
    """Return whether the item was taken; False where it is not wanted any more."""
    while not unwanted.is_set():
        try:
            waiting.put(item, timeout=_POLL_S)
            return True
        except queue.Full:
            continue
    return False
