"""OpenCV and FFmpeg without their noise on stderr."""
from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import lru_cache
import os
from threading import Lock
from typing import Any

import cv2

#: cv2's LOG_LEVEL_FATAL, which its Python module does not name.
LOG_FATAL = 1
_OPTIONS = 'OPENCV_FFMPEG_CAPTURE_OPTIONS'
_lock = Lock()


def open_capture(
    source: str, backend: int, *, parameters: Sequence[int] = (), ffmpeg_options: str = '',
) -> Any:
    """
    Return the cv2.VideoCapture of a path, device or URL, which may have failed to open.

    :param backend: cv2.CAP_FFMPEG or cv2.CAP_V4L2.
    :param parameters: pairs of property and value that take effect at opening.
    :param ffmpeg_options: in OpenCV's form key;value|key;value; the user's own in
        OPENCV_FFMPEG_CAPTURE_OPTIONS take their place.
    """
    silence()
    with _lock, _environment(_OPTIONS, ffmpeg_options):
        return cv2.VideoCapture(source, backend, list(parameters))


@lru_cache(maxsize=1)
def silence() -> None:
    """
    Keep OpenCV and FFmpeg from warning of what this package reports in better words.

    FFmpeg's own messages repeat URLs with their passwords. Who wants them back sets
    OPENCV_FFMPEG_LOGLEVEL and OPENCV_LOG_LEVEL.
    """
    os.environ.setdefault('OPENCV_FFMPEG_LOGLEVEL', '-8')  # which is FFmpeg's `quiet`
    if 'OPENCV_LOG_LEVEL' not in os.environ:
        getattr(cv2.utils, 'logging', cv2).setLogLevel(LOG_FATAL)  # its place in OpenCV 5 and 4


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
