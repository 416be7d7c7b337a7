"""Frames of a video file."""
from __future__ import annotations

from collections.abc import Callable
import logging
import math
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from depth_person.camera.frame import Frame
from depth_person.camera.opencv import open_capture
from depth_person.camera.source import mask_password, Source, SourceLost
from depth_person.camera.stream_fault import stream_fault
from depth_person.errors import DepthPersonError

LOG = logging.getLogger(__name__)
#: For files that do not say.
DEFAULT_FPS = 30.0
#: These list their frames. Of others OpenCV computes the number from the longest track, sound
#: included, so that it is only near the truth.
COUNTED_SUFFIXES = ('.mp4', '.m4v', '.mov', '.avi')
#: How long a web server may take, milliseconds.
_WEB_TIMEOUTS = (cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, 5000, cv2.CAP_PROP_READ_TIMEOUT_MSEC, 5000)


class VideoFile(Source):
    """
    A video file that FFmpeg reads, as fast as its frames are asked for.

    Stamps count from the time of opening at the file's frame rate.

    :param path: of the file, or a URL that a web server has it under.
    :param fps: frames a second, instead of the file's.
    :param loop: start over at the end, with stamps that go on.
    :raises DepthPersonError: when the file cannot be read as a video.
    """

    def __init__(
        self, path: str, *, frame_id: str, clock: Callable[[], int], fps: float | None = None,
        loop: bool = False,
    ) -> None:
        self._path = path
        self._name = mask_password(path)
        self.description = f'video {self._name}'
        self._frame_id = frame_id
        self._loop = loop
        self._capture, self._first = self._open()
        self.fps = fps or self._container_fps()
        self._stated = self._capture.get(cv2.CAP_PROP_FRAME_COUNT)
        self._count = 0
        self._start_ns = clock()

    def read(self) -> Frame | None:
        """
        Return the next frame; None at the end of the file.

        :raises SourceLost: when the file ends before it says it does.
        """
        image = self._next_image()
        if image is None:
            self._check_whole()
            if self._loop and self._capture.isOpened():
                self._capture.release()
                self._capture, self._first = self._open()
                image = self._next_image()
        if image is None:
            return None
        stamp_ns = self._start_ns + round(self._count * 1e9 / self.fps)
        self._count += 1
        return Frame(image, stamp_ns, self._frame_id)

    def close(self) -> None:
        """Close the file."""
        self._first = None
        self._capture.release()

    def _open(self) -> tuple[Any, NDArray[np.uint8] | None]:
        """Open the file and read its first image, without which it is of no use."""
        # FFmpeg takes what stands before a colon for a protocol, but not in an absolute path.
        on_web = '://' in self._path
        path = self._path if on_web else str(Path(self._path).absolute())
        capture = open_capture(path, cv2.CAP_FFMPEG, parameters=_WEB_TIMEOUTS if on_web else ())
        good, image = capture.read()
        if not good:
            capture.release()
            if on_web:
                raise stream_fault(self._path)
            raise DepthPersonError(
                f'{self._name} cannot be read as a video: it is torn, empty or of another kind; '
                'try it in a player')
        return capture, image

    def _container_fps(self) -> float:
        fps = self._capture.get(cv2.CAP_PROP_FPS)
        if math.isfinite(fps) and fps > 0:
            return fps
        LOG.warning('%s does not say its frame rate; taken as %g', self._name, DEFAULT_FPS)
        return DEFAULT_FPS

    def _next_image(self) -> NDArray[np.uint8] | None:
        image, self._first = self._first, None
        if image is not None:
            return image
        good, image = self._capture.read()
        return image if good else None

    def _check_whole(self) -> None:
        """Raise SourceLost when fewer frames came than the file states; once is enough."""
        exact = Path(self._path).suffix.lower() in COUNTED_SUFFIXES
        tolerated = 2 if exact else max(2.0, self.fps)
        if self._capture.isOpened() and self._stated - self._count > tolerated:
            raise SourceLost(
                f'{self._name} is torn: {self._count} of {self._stated:.0f} frames could be '
                'read; copy or record it again')
