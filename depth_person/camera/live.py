"""Frames of cameras and streams, which come whether or not they are read."""
from __future__ import annotations

from collections.abc import Callable
import math
import os
from pathlib import Path
from threading import Condition, Thread
import time
from typing import Any, Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from depth_person.camera.frame import Frame
from depth_person.camera.opencv import open_capture
from depth_person.camera.source import mask_password, Source, SourceLost
from depth_person.errors import DepthPersonError

#: How long a stream may take to open and to show its first frame.
OPEN_TIMEOUT_S = 5.0


class Capture(Protocol):
    """What is used of cv2.VideoCapture."""

    def grab(self) -> bool:
        """Wait for the next frame; False when there is none."""
        ...

    def retrieve(self) -> tuple[bool, Any]:
        """Return whether the grabbed frame could be decoded, and its image."""
        ...

    def release(self) -> None:
        """Close the device or stream."""
        ...


class LiveSource(Source):
    """
    The newest frame of a camera or stream.

    A thread takes every frame as it arrives, so that no queue of a driver grows old. What the
    reader is too slow for is dropped and counted.

    Stamps are the time of arrival by `clock`.

    :param timeout_s: without a frame for so long the source counts as lost.
    :ivar dropped: frames that arrived and were never read.
    """

    live = True

    def __init__(
        self, capture: Capture, *, description: str, frame_id: str, clock: Callable[[], int],
        timeout_s: float,
    ) -> None:
        self.description = description
        self.dropped = 0
        self._capture = capture
        self._frame_id = frame_id
        self._clock = clock
        self._timeout_s = timeout_s
        self._arrived = Condition()
        self._newest: tuple[NDArray[np.uint8], int] | None = None
        self._count = 0
        self._deadline = time.monotonic() + max(timeout_s, OPEN_TIMEOUT_S)
        self._end: str | None = None  # why no more frames come
        self._closed = False
        # A daemon, since a driver may hold it beyond any time-out.
        self._thread = Thread(target=self._take_frames, name='camera', daemon=True)
        self._thread.start()

    def read(self) -> Frame | None:
        """
        Return the newest frame that has not been read yet, waiting for it.

        :returns: None when the source is closed meanwhile.
        :raises SourceLost: when no frame comes within the time-out, or the stream has ended.
        """
        with self._arrived:
            while self._newest is None:
                if self._closed:
                    return None
                left_s = self._deadline - time.monotonic()
                if self._end or left_s <= 0:
                    reason = self._end or f'no frame for {self._timeout_s:g} s'
                    raise SourceLost(
                        f'{self.description} is lost after {self._count} frames: {reason}; check '
                        'that it is still there and sending')
                self._arrived.wait(left_s)
            (image, stamp_ns), self._newest = self._newest, None
        return Frame(image, stamp_ns, self._frame_id)

    def close(self) -> None:
        """Stop the thread, which closes the device or stream; a second call does nothing."""
        with self._arrived:
            self._closed = True
            self._newest = None
            self._arrived.notify_all()
        self._thread.join(self._timeout_s + 0.5)

    def _take_frames(self) -> None:
        """Keep the newest frame until the source ends or is closed."""
        end = 'it has stopped sending'
        try:
            while not self._closed and self._capture.grab():
                stamp_ns = self._clock()
                good, image = self._capture.retrieve()
                if good:
                    self._keep(image, stamp_ns)
        except cv2.error as error:
            end = f'OpenCV fails to read it ({error})'
        finally:
            self._capture.release()
            with self._arrived:
                self._end = end
                self._arrived.notify_all()

    def _keep(self, image: NDArray[np.uint8], stamp_ns: int) -> None:
        with self._arrived:
            if self._closed:
                return
            self.dropped += self._newest is not None
            self._newest = image, stamp_ns
            self._count += 1
            self._deadline = time.monotonic() + self._timeout_s
            self._arrived.notify_all()


def open_device(
    device: str, *, frame_id: str, clock: Callable[[], int], fps: float | None, timeout_s: float,
) -> LiveSource:
    """
    Open a V4L2 camera.

    :param device: such as /dev/video0.
    :param fps: the rate to ask the camera for.
    :raises DepthPersonError: listing the devices that there are.
    """
    path = Path(device)
    if not path.exists():
        raise DepthPersonError(f'there is no camera {device}; {_list_devices()}')
    try:
        path.open('rb').close()
    except PermissionError as error:
        raise DepthPersonError(
            f'no permission to use {device}; add your user to the group video and log in again'
        ) from error
    except OSError as error:
        raise DepthPersonError(f'{device} cannot be opened: {error.strerror}') from error
    # OpenCV waits ten seconds for a frame unless told otherwise before its first one.
    os.environ.setdefault('OPENCV_VIDEOIO_V4L_SELECT_TIMEOUT', str(math.ceil(timeout_s)))
    capture = open_capture(device, cv2.CAP_V4L2)
    if not capture.isOpened():
        raise DepthPersonError(
            f'{device} gives no video: it is busy in another program, or is no camera; '
            f'{_list_devices()}')
    capture.set(cv2.CAP_PROP_BUFFERSIZE, 1)
    if fps:
        capture.set(cv2.CAP_PROP_FPS, fps)
    return LiveSource(capture, description=f'camera {device}', frame_id=frame_id, clock=clock,
                      timeout_s=timeout_s)


def open_stream(
    url: str, *, frame_id: str, clock: Callable[[], int], timeout_s: float,
) -> LiveSource:
    """
    Open a stream that FFmpeg reads: a URL, or the path of an SDP file.

    :raises DepthPersonError: when it does not open; the message holds no password.
    """
    capture = open_capture(
        url, cv2.CAP_FFMPEG,
        parameters=(cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, int(OPEN_TIMEOUT_S * 1000),
                    cv2.CAP_PROP_READ_TIMEOUT_MSEC, int(timeout_s * 1000)),
        ffmpeg_options='protocol_whitelist;file,rtp,udp' if url.endswith('.sdp') else '')
    if not capture.isOpened():
        raise DepthPersonError(
            f'stream {mask_password(url)} cannot be opened: nobody sends there, it refuses, or '
            'user and password are wrong; try the URL in a player')
    return LiveSource(capture, description=f'stream {mask_password(url)}', frame_id=frame_id,
                      clock=clock, timeout_s=timeout_s)


def _list_devices() -> str:
    """Return a sentence on the V4L2 devices of this machine."""
    devices = []
    for path in sorted(Path('/dev').glob('video*')):
        name = Path('/sys/class/video4linux', path.name, 'name')
        devices.append(f'{path} ({name.read_text().strip()})' if name.exists() else str(path))
    if not devices:
        return 'no /dev/video* exists: plug a camera in, or pass one through to this container'
    return f'there are {", ".join(devices)}'
