"""Frames from a rosbag."""
from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
import logging
from pathlib import Path
from typing import Any

from depth_person.camera.bag import BagReader
from depth_person.camera.encodings import decode_compressed, to_bgr
from depth_person.camera.frame import Frame
from depth_person.camera.intrinsics import Intrinsics
from depth_person.camera.source import Source, SourceLost
from depth_person.errors import DepthPersonError

LOG = logging.getLogger(__name__)
IMAGE = 'sensor_msgs/msg/Image'
COMPRESSED_IMAGE = 'sensor_msgs/msg/CompressedImage'
CAMERA_INFO = 'sensor_msgs/msg/CameraInfo'


class BagSource(Source):
    """
    The images of one topic of a rosbag, with their recorded stamps, frames and intrinsics.

    The intrinsics are those of the last CameraInfo before the image; before the first one, those
    of the first.

    :param image_topic: of type Image or CompressedImage; None takes the only one there is.
    :param frame_id: for images that name none.
    :param loop: start over at the end, with stamps that go on.
    :ivar skipped: how many images could not be read.
    :ivar bad_camera_infos: how many CameraInfo messages could not be used.
    :raises DepthPersonError: when the bag has no such images, or several topics of them.
    """

    def __init__(
        self, path: Path, *, frame_id: str, image_topic: str | None = None, loop: bool = False,
    ) -> None:
        self.description = f'bag {path}'
        self.skipped = 0
        self.bad_camera_infos = 0
        self._first_fault = ''
        self._frame_id = frame_id
        self._loop = loop
        self._reader = BagReader(path)
        try:
            self._image_topic = self._choose_image_topic(image_topic)
            self._info_topic = self._choose_info_topic()
            self._intrinsics = self._first_intrinsics()
        except BaseException:
            self._reader.close()
            raise
        self._frames: Iterator[Frame] = self._read_all()

    def read(self) -> Frame | None:
        """Return the next image that can be read; None at the end of the bag."""
        return next(self._frames, None)

    def close(self) -> None:
        """Close the bag."""
        self._frames = iter(())
        self._reader.close()

    def _read_all(self) -> Iterator[Frame]:
        """Yield the frames of the bag, again and again when it loops."""
        shift_ns = 0
        while True:
            first_ns, last_ns, count = 0, 0, 0
            for frame in self._read_once():
                first_ns = frame.stamp_ns if count == 0 else first_ns
                last_ns, count = frame.stamp_ns, count + 1
                yield replace(frame, stamp_ns=frame.stamp_ns + shift_ns) if shift_ns else frame
            if self._reader.damage:
                raise SourceLost(f'{self._reader.damage}; {count} images were read')
            if not count:
                raise DepthPersonError(
                    f'{self.description} gives no image on {self._image_topic}: '
                    f'{self._first_fault or "it holds no message there"}')
            if not self._loop:
                return
            shift_ns += last_ns - first_ns + (last_ns - first_ns) // max(count - 1, 1)

    def _read_once(self) -> Iterator[Frame]:
        topics = [self._image_topic, *filter(None, [self._info_topic])]
        for topic, time_ns, message in self._reader.messages(topics):
            if topic == self._info_topic:
                self._intrinsics = self._to_intrinsics(message)
                continue
            try:
                yield self._to_frame(message, time_ns)
            except DepthPersonError as error:
                self._skip(error)

    def _skip(self, error: DepthPersonError) -> None:
        self.skipped += 1
        if self.skipped == 1:
            self._first_fault = str(error)
            LOG.warning('%s: an image on %s is left out, as will be others like it: %s',
                        self.description, self._image_topic, error)

    def _to_frame(self, message: Any, time_ns: int) -> Frame:
        if message.__msgtype__ == IMAGE:
            image = to_bgr(
                message.data, encoding=message.encoding, height=message.height,
                width=message.width, step=message.step, is_bigendian=bool(message.is_bigendian))
        else:
            image = decode_compressed(message.data, message.format)
        stamp = message.header.stamp
        stamp_ns = stamp.sec * 10**9 + stamp.nanosec
        intrinsics = self._intrinsics
        if intrinsics is not None and not intrinsics.fits(image):
            self._note_misfit(intrinsics, image.shape)
            intrinsics = None
        # A stamp of zero is none: the time of recording is the nearest to it.
        return Frame(image, stamp_ns or time_ns, message.header.frame_id or self._frame_id,
                     intrinsics)

    def _choose_image_topic(self, wanted: str | None) -> str:
        candidates = self._reader.topics_of_type(IMAGE, COMPRESSED_IMAGE)
        listed = ', '.join(
            f'{name} ({self._reader.topics[name].msgtype})' for name in candidates)
        if wanted is not None:
            wanted = '/' + wanted.lstrip('/')
            if wanted not in candidates:
                raise DepthPersonError(
                    f'{self.description} has no image topic {wanted}; it has {listed or "none"}')
            return wanted
        if not candidates:
            raise DepthPersonError(
                f'{self.description} has no topic of type {IMAGE} or {COMPRESSED_IMAGE}; it has '
                f'{", ".join(self._reader.topics) or self._reader.damage or "no topics"}')
        if len(candidates) > 1:
            raise DepthPersonError(
                f'{self.description} has several image topics; choose by image_topic: {listed}')
        return candidates[0]

    def _choose_info_topic(self) -> str | None:
        """Return the camera_info beside the images, or else the only one, or None."""
        camera = self._image_topic.removesuffix('/compressed').rpartition('/')[0]
        candidates = self._reader.topics_of_type(CAMERA_INFO)
        if f'{camera}/camera_info' in candidates:
            return f'{camera}/camera_info'
        if len(candidates) == 1:
            return candidates[0]
        LOG.warning('%s has %s CameraInfo for %s: its images are uncalibrated', self.description,
                    'no single' if candidates else 'no', self._image_topic)
        return None

    def _first_intrinsics(self) -> Intrinsics | None:
        """Return what the first CameraInfo says, which may come later than the first images."""
        if self._info_topic is None:
            return None
        for _, _, message in self._reader.messages([self._info_topic]):
            return self._to_intrinsics(message)
        LOG.warning('%s holds no message on %s: its images are uncalibrated',
                    self.description, self._info_topic)
        return None

    def _to_intrinsics(self, message: Any) -> Intrinsics | None:
        """Return the intrinsics of a CameraInfo; None, and counted, when they are faulty."""
        try:
            return Intrinsics.from_camera_info_fields(
                message.width, message.height, message.distortion_model, message.d, message.k)
        except DepthPersonError as error:
            self.bad_camera_infos += 1
            if self.bad_camera_infos == 1:
                LOG.warning('%s: a CameraInfo on %s cannot be used: %s',
                            self.description, self._info_topic, error)
            return None

    def _note_misfit(self, intrinsics: Intrinsics, shape: tuple[int, ...]) -> None:
        self.bad_camera_infos += 1
        if self.bad_camera_infos == 1:
            LOG.warning(
                '%s: images of %dx%d px, but %s is for %dx%d px: they are taken as uncalibrated',
                self.description, shape[1], shape[0], self._info_topic, intrinsics.width,
                intrinsics.height)
