"""Frames from a folder of images."""
from __future__ import annotations

from collections.abc import Callable
import logging
from pathlib import Path

from depth_person.camera.encodings import decode_compressed
from depth_person.camera.frame import Frame
from depth_person.camera.source import Source
from depth_person.errors import DepthPersonError

LOG = logging.getLogger(__name__)
IMAGE_SUFFIXES = ('.jpg', '.jpeg', '.png', '.bmp', '.tif', '.tiff', '.webp')
DEFAULT_FPS = 30.0


class ImageFolder(Source):
    """
    The images of a folder in the order of their names.

    Stamps count from the time of opening at the given rate. An image that cannot be decoded is
    left out, its time is not.

    :ivar skipped: how many images could not be decoded.
    :raises DepthPersonError: when the folder holds no images.
    """

    def __init__(
        self, path: Path, *, frame_id: str, clock: Callable[[], int], fps: float | None = None,
        loop: bool = False,
    ) -> None:
        self.description = f'images in {path}'
        self.fps = fps or DEFAULT_FPS
        self.skipped = 0
        self._path = path
        self._frame_id = frame_id
        self._loop = loop
        self._files = sorted(
            file for file in path.iterdir()
            if file.suffix.lower() in IMAGE_SUFFIXES and not file.name.startswith('.'))
        if not self._files:
            raise DepthPersonError(
                f'folder {path} holds no images ({", ".join(IMAGE_SUFFIXES)}) and no rosbag')
        self._index = 0
        self._start_ns = clock()

    def read(self) -> Frame | None:
        """Return the next image that can be read; None after the last."""
        while self._files and (self._loop or self._index < len(self._files)):
            file = self._files[self._index % len(self._files)]
            stamp_ns = self._start_ns + round(self._index * 1e9 / self.fps)
            self._index += 1
            try:
                image = decode_compressed(file.read_bytes())
            except (DepthPersonError, OSError) as error:
                self._skip(file, error)
                continue
            return Frame(image, stamp_ns, self._frame_id)
        return None

    def close(self) -> None:
        """End the sequence."""
        self._files = []

    def _skip(self, file: Path, error: Exception) -> None:
        """Count an image that cannot be read; raise when it is like all others."""
        self.skipped += 1
        if self.skipped == 1:
            LOG.warning('%s is left out, as will be others like it: %s', file, error)
        if self.skipped == len(self._files):
            raise DepthPersonError(
                f'none of the {len(self._files)} images in {self._path} can be read; '
                f'{file.name}: {error}')
