"""Frames of cameras and streams, which come whether or not they are read."""
from __future__ import annotations

from collections.abc import Callable
from threading import Condition, Thread
import time

import cv2
import numpy as np
from numpy.typing import NDArray

from depth_person.camera.frame import Frame
from depth_person.camera.opencv import Capture
from depth_person.camera.source import Source, SourceLost
from depth_person.camera.stamps import Stamper

#: How long a stream may take to open and to show its first frame.
OPEN_TIMEOUT_S = 5.0


class LiveSource(Source):
    """
    The newest frame of a camera or stream.

    A thread takes every frame as it arrives, so that no queue of a driver grows old. What the
    reader is too slow for is dropped and counted.

    :param stamps: when a frame was taken, from what the driver says and its arrival.
    :param clock: gives the time of arrival, nanoseconds.
    :param timeout_s: without a frame for so long the source counts as lost.
    :ivar dropped: frames that arrived and were never read.
    """

    live = True

    def __init__(
        self, capture: Capture, *, description: str, frame_id: str, clock: Callable[[], int],
        timeout_s: float, stamps: Stamper,
    ) -> None:
        self.description = description
        self.dropped = 0
        self._capture = capture
        self._frame_id = frame_id
        self._clock = clock
        self._stamps = stamps
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
                stamp_ns = self._stamps.stamp_ns(
                    self._capture.get(cv2.CAP_PROP_POS_MSEC), arrival_ns=self._clock(),
                    monotonic_s=time.monotonic())
                if stamp_ns is None:
                    continue
                good, image = self._capture.retrieve()
                if good:
                    self._keep(image, stamp_ns)
        except SourceLost as error:
            end = str(error)
        except cv2.error as error:
            end = f'OpenCV fails to read it ({error.err})'
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
