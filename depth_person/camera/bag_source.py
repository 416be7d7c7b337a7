"""Frames from a rosbag."""
from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
import logging
from pathlib import Path

from depth_person.camera.bag import BagReader
from depth_person.camera.bag_frames import FrameMaker
from depth_person.camera.bag_topics import choose_image_topic, choose_info_topic
from depth_person.camera.frame import Frame
from depth_person.camera.source import Source, SourceLost
from depth_person.errors import DepthPersonError

LOG = logging.getLogger(__name__)


class BagSource(Source):
    """
    The images of one topic of a rosbag, with their recorded stamps, frames and intrinsics.

    The intrinsics are those of the last CameraInfo before the image; before the first one, those
    of the first.

    :param image_topic: of type Image or CompressedImage; None takes the only one there is.
    :param frame_id: for images that name none.
    :param loop: start over at the end, with stamps that go on.
    :ivar skipped: how many images could not be read.
    :raises DepthPersonError: when the bag has no such images, or several topics of them.
    """

    recorded = True

    def __init__(
        self, path: Path, *, frame_id: str, image_topic: str | None = None, loop: bool = False,
    ) -> None:
        self.description = f'bag {path}'
        self.skipped = 0
        self._first_fault = ''
        self._loop = loop
        self._reader = BagReader(path)
        try:
            topics, damage = self._reader.topics, self._reader.damage
            where = f'{self.description} ({damage})' if damage else self.description
            self._image_topic = choose_image_topic(
                topics, image_topic, where=where, option='image_topic')
            self._info_topic = choose_info_topic(
                topics, None, image_topic=self._image_topic, where=where)
            self._maker = FrameMaker(
                self.description, info_topic=self._info_topic, frame_id=frame_id)
            self._take_first_camera_info()
        except BaseException:
            self._reader.close()
            raise
        self._frames: Iterator[Frame] = self._read_all()

    @property
    def bad_camera_infos(self) -> int:
        """How many CameraInfo messages could not be used."""
        return self._maker.bad_camera_infos

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
                self._maker.take_camera_info(message)
                continue
            try:
                yield self._maker.frame(message, time_ns)
            except DepthPersonError as error:
                self._skip(error)

    def _skip(self, error: DepthPersonError) -> None:
        self.skipped += 1
        if self.skipped == 1:
            self._first_fault = str(error)
            LOG.warning('%s: an image on %s is left out, as will be others like it: %s',
                        self.description, self._image_topic, error)

    def _take_first_camera_info(self) -> None:
        """Take what the first CameraInfo says, which may come later than the first images."""
        if self._info_topic is None:
            LOG.warning('%s has no single CameraInfo for %s: its images are uncalibrated',
                        self.description, self._image_topic)
            return
        for _, _, message in self._reader.messages([self._info_topic]):
            self._maker.take_camera_info(message)
            return
        LOG.warning('%s holds no message on %s: its images are uncalibrated',
                    self.description, self._info_topic)
