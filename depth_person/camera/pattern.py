"""A picture that moves and numbers its frames, for trying everything out without a camera."""
from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from threading import Event
import time

import numpy as np
from numpy.typing import NDArray

from depth_person.camera.frame import Frame
from depth_person.camera.source import Source, SourceUnusable

DEFAULT_SIZE = (1280, 720)
DEFAULT_FPS = 30.0
_SMALLEST = 64
_LARGEST = 8192
#: The number stands in the top row of cells, the lowest bit to the left, then its complement
#: below: so a frame that is torn or is no pattern is told.
_BITS = 24


class PatternSource(Source):
    """
    A live source that draws its frames when they are due.

    :param size: width and height, pixels.
    :param fps: frames a second.
    :raises SourceUnusable: for sizes that no camera has.
    """

    live = True

    def __init__(
        self, *, frame_id: str, clock: Callable[[], int], size: tuple[int, int] = DEFAULT_SIZE,
        fps: float = DEFAULT_FPS,
    ) -> None:
        width, height = size
        if not (_SMALLEST <= width <= _LARGEST and _SMALLEST <= height <= _LARGEST):
            raise SourceUnusable(
                f'a test pattern of {width}x{height} px is not between {_SMALLEST} and {_LARGEST}')
        self.description = f'test pattern {width}x{height} at {fps:g} Hz'
        self.dropped = 0
        self._size = size
        self._fps = fps
        self._frame_id = frame_id
        self._clock = clock
        self._start_s = time.monotonic()
        self._next = 0
        self._closed = Event()

    def read(self) -> Frame | None:
        """Return the frame that is due, waiting for it; None once closed."""
        due = int((time.monotonic() - self._start_s) * self._fps)
        self.dropped += max(due - self._next, 0)
        number = max(due, self._next)
        if self._closed.wait(max(self._start_s + number / self._fps - time.monotonic(), 0)):
            return None
        stamp_ns = self._clock()
        self._next = number + 1
        return Frame(draw_pattern(number, self._size), stamp_ns, self._frame_id)

    def close(self) -> None:
        """End the pattern, and a read that waits."""
        self._closed.set()


def draw_pattern(number: int, size: tuple[int, int]) -> NDArray[np.uint8]:
    """
    Return a frame of the pattern: colour ramps that wander, under the frame's number.

    :param number: 0 to 2**24 - 1; higher ones start over.
    :param size: width and height, pixels, 64 at least.
    :returns: (height, width, 3) uint8.
    """
    width, height = size
    image = np.roll(_background(width, height), 4 * number % width, axis=1)
    cell_rows = height // 16
    bits = (number >> (np.arange(width) * _BITS // width)) & 1
    image[:cell_rows] = (255 * bits).astype(np.uint8)[:, None]
    image[cell_rows:2 * cell_rows] = 255 - image[0]
    return image


def read_number(image: NDArray[np.uint8]) -> int | None:
    """Return the number of a frame that may have been compressed and scaled; None if damaged."""
    height, width = image.shape[:2]
    rows = (np.array([0.5, 1.5]) * (height / 16)).astype(int)
    columns = ((np.arange(_BITS) + 0.5) * (width / _BITS)).astype(int)
    cells = image[rows[:, None], columns].mean(axis=-1)
    if np.any(np.abs(cells[0] - cells[1]) < 64):
        return None
    return int(((cells[0] > cells[1]).astype(int) << np.arange(_BITS)).sum())


@lru_cache(maxsize=2)
def _background(width: int, height: int) -> NDArray[np.uint8]:
    x, y = np.linspace(0, 2 * np.pi, width), np.linspace(0, 200, height)
    image = np.empty((height, width, 3), np.uint8)
    image[..., 0] = 128 + 100 * np.sin(x)
    image[..., 1] = y[:, None]
    image[..., 2] = 128 + 100 * np.cos(x)
    return image
