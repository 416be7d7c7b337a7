"""Opens cv2.VideoCapture without its noise on stderr."""
from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
import os
from threading import Lock
from typing import Any

import cv2

# FFmpeg's own messages (-8 is quiet) repeat URLs with their passwords; OpenCV reads this
# when it first opens a file or stream.
os.environ.setdefault('OPENCV_FFMPEG_LOGLEVEL', '-8')

_OPTIONS = 'OPENCV_FFMPEG_CAPTURE_OPTIONS'
_SILENT = 0
_lock = Lock()


def open_capture(
    source: str, backend: int, *, parameters: Sequence[int] = (), ffmpeg_options: str = '',
) -> Any:
    """
    Return the cv2.VideoCapture of a path, device or URL, which may have failed to open.

    :param backend: cv2.CAP_FFMPEG or cv2.CAP_V4L2.
    :param parameters: pairs of property and value that take effect at opening.
    :param ffmpeg_options: in OpenCV's form key;value|key;value; the user's own in
        OPENCV_FFMPEG_CAPTURE_OPTIONS go first.
    """
    with _lock, _quiet(), _environment(_OPTIONS, ffmpeg_options):
        return cv2.VideoCapture(source, backend, list(parameters))


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep OpenCV from logging what its caller reports in better words."""
    module = getattr(cv2.utils, 'logging', cv2)  # OpenCV 5 and 4
    before = module.getLogLevel()
    module.setLogLevel(_SILENT)
    try:
        yield
    finally:
        module.setLogLevel(before)


@contextmanager
def _environment(name: str, value: str) -> Iterator[None]:
    """Set an environment variable for a while, unless it is set or there is nothing to set."""
    if not value or name in os.environ:
        yield
        return
    os.environ[name] = value
    try:
        yield
    finally:
        del os.environ[name]
