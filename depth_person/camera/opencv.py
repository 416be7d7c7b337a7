"""OpenCV and FFmpeg without their noise on stderr."""
from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
import os
from queue import Empty, Queue
from threading import Event, Lock, Thread
from typing import Any, Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from depth_person.errors import DepthPersonError

_LOG_LEVEL_FATAL = 1  # which cv2 does not name
_OPTIONS = 'OPENCV_FFMPEG_CAPTURE_OPTIONS'
#: How long one opening may hold up another: longer than any that ends.
_LOCK_TIMEOUT_S = 15.0
_lock = Lock()

# What OpenCV and FFmpeg warn of, this package reports in better words, and FFmpeg repeats URLs
# with their passwords. Who wants their messages sets these variables. It has to be done on import:
# FFmpeg's level is taken from the environment when OpenCV first uses it, for whatever purpose.
os.environ.setdefault('OPENCV_FFMPEG_LOGLEVEL', '-8')  # FFmpeg's `quiet`
if 'OPENCV_LOG_LEVEL' not in os.environ:
    getattr(cv2.utils, 'logging', cv2).setLogLevel(_LOG_LEVEL_FATAL)  # in OpenCV 5, and in 4


class Capture(Protocol):
    """What is used of cv2.VideoCapture."""

    def isOpened(self) -> bool:  # noqa: N802 - OpenCV's name
        """Return whether the device or stream is open."""
        ...

    def grab(self) -> bool:
        """Wait for the next frame; False when there is none."""
        ...

    def retrieve(self) -> tuple[bool, Any]:
        """Return whether the grabbed frame could be decoded, and its image."""
        ...

    def get(self, prop: int) -> float:
        """Return a property; 0 where it is not known."""
        ...

    def set(self, prop: int, value: float) -> bool:
        """Ask for a property."""
        ...

    def release(self) -> None:
        """Close the device or stream."""
        ...


def open_capture(
    source: str, backend: int, *, parameters: Sequence[int] = (), ffmpeg_options: str = '',
) -> Any:
    """
    Return the cv2.VideoCapture of a path, device or URL, which may have failed to open.

    :param backend: cv2.CAP_FFMPEG, cv2.CAP_V4L2 or cv2.CAP_GSTREAMER.
    :param parameters: pairs of property and value that take effect at opening.
    :param ffmpeg_options: in OpenCV's form key;value|key;value; the user's own in
        OPENCV_FFMPEG_CAPTURE_OPTIONS come on top and win.
    :raises DepthPersonError: when an earlier opening hangs.
    """
    if not _lock.acquire(timeout=_LOCK_TIMEOUT_S):
        raise DepthPersonError('an earlier attempt to open a camera or stream still hangs')
    try:
        with _environment(_OPTIONS, '|'.join(
                filter(None, (ffmpeg_options, os.environ.get(_OPTIONS))))):
            return cv2.VideoCapture(source, backend, list(parameters))
    finally:
        _lock.release()


def open_within(seconds: float, opening: Callable[[], Capture]) -> Capture | None:
    """
    Return what opens within a time; None when it does not, and it is released if it still comes.

    Drivers and servers may hold an opening for longer than they are told to.

    :raises DepthPersonError: what the opening raises.
    """
    outcome: Queue[Capture | Exception] = Queue()
    given_up = Event()

    def run() -> None:
        try:
            capture = opening()
        except Exception as error:  # is raised again where it is waited for
            outcome.put(error)
            return
        outcome.put(capture)
        if given_up.is_set():
            capture.release()

    Thread(target=run, name='opening', daemon=True).start()
    try:
        result = outcome.get(timeout=seconds)
    except Empty:
        given_up.set()
        with suppress(Empty):  # it may have come in between
            late = outcome.get_nowait()
            if not isinstance(late, Exception):
                late.release()
        return None
    if isinstance(result, Exception):
        raise result
    return result


def decode_image(buffer: NDArray[np.uint8]) -> NDArray[np.uint8] | None:
    """Return the BGR picture in the bytes of an image file; None when there is none."""
    try:
        return cv2.imdecode(buffer, cv2.IMREAD_COLOR) if buffer.size else None
    except cv2.error:  # sizes beyond OpenCV's limits, as damage to the head makes them
        return None


@contextmanager
def _environment(name: str, value: str) -> Iterator[None]:
    """Set an environment variable for a while, unless there is nothing to set."""
    before = os.environ.get(name)
    if not value:
        yield
        return
    os.environ[name] = value
    try:
        yield
    finally:
        if before is None:
            del os.environ[name]
        else:
            os.environ[name] = before
