"""OpenCV and FFmpeg without their noise on stderr."""
from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
import os
from threading import Lock
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

_LOG_LEVEL_FATAL = 1  # which cv2 does not name
_OPTIONS = 'OPENCV_FFMPEG_CAPTURE_OPTIONS'
_lock = Lock()

# What OpenCV and FFmpeg warn of, this package reports in better words, and FFmpeg repeats URLs
# with their passwords. Who wants their messages sets these variables. It has to be done on import:
# FFmpeg's level is taken from the environment when OpenCV first uses it, for whatever purpose.
os.environ.setdefault('OPENCV_FFMPEG_LOGLEVEL', '-8')  # FFmpeg's `quiet`
if 'OPENCV_LOG_LEVEL' not in os.environ:
    getattr(cv2.utils, 'logging', cv2).setLogLevel(_LOG_LEVEL_FATAL)  # in OpenCV 5, and in 4


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
    with _lock, _environment(_OPTIONS, ffmpeg_options):
        return cv2.VideoCapture(source, backend, list(parameters))


def decode_image(buffer: NDArray[np.uint8]) -> NDArray[np.uint8] | None:
    """Return the BGR picture in the bytes of an image file; None when there is none."""
    try:
        return cv2.imdecode(buffer, cv2.IMREAD_COLOR) if buffer.size else None
    except cv2.error:  # sizes beyond OpenCV's limits, as damage to the head makes them
        return None


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
