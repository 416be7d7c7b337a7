"""The messages of bags, cut into steps: one frame each, with what was recorded before it."""
from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from depth_person.camera.bag_frames import FrameMaker
from depth_person.camera.frame import Frame
from depth_person.camera.message_fields import stamp_ns
from depth_person.errors import DepthPersonError
from depth_person.replay.input_bags import InputBags, RawMessage

#: A step without a frame ends at so many messages or bytes, so that memory stays bounded.
_LONGEST = 1000
_LARGEST = 1 << 24


@dataclass(frozen=True, eq=False)
class Step:
    """
    A frame and the messages between the frame before and it.

    :ivar others: in the order of recording.
    :ivar image: the frame's message; None at the end of the bags, or in the middle of many others.
    :ivar frame: None for an image that cannot be decoded, too.
    """

    others: list[RawMessage]
    image: RawMessage | None = None
    frame: Frame | None = None


@dataclass
class Oddities:
    """
    What of the images was not as it should be.

    :ivar undecodable: images that hold no picture.
    :ivar first_undecodable: what is wrong with the first of them.
    :ivar unstamped: frames whose stamp was zero.
    :ivar disordered: frames whose stamp was before that of the frame before.
    :ivar repeated: frames whose stamp an earlier frame has.
    :ivar uncalibrated: frames for which no intrinsics were known.
    """

    undecodable: int = 0
    first_undecodable: str = ''
    unstamped: int = 0
    disordered: int = 0
    repeated: int = 0
    uncalibrated: int = 0


class StepReader:
    """
    Cuts the messages of bags into steps and decodes their frames.

    The intrinsics of a frame are those of the last CameraInfo before it; before the first one,
    those of the first.

    :param info_topic: of the CameraInfo; None takes the images as uncalibrated.
    :ivar oddities: complete when the steps have been read.
    """

    def __init__(self, bags: InputBags, *, image_topic: str, info_topic: str | None) -> None:
        self.oddities = Oddities()
        self._bags = bags
        self._image_topic = image_topic
        self._info_topic = info_topic
        self._maker = FrameMaker(bags.description, info_topic=info_topic, frame_id='')
        self._last_ns: int | None = None
        self._seen_ns: set[int] = set()

    @property
    def bad_camera_infos(self) -> int:
        """How many CameraInfo messages could not be used."""
        return self._maker.bad_camera_infos

    def steps(self) -> Iterator[Step]:
        """Yield the steps in the order of recording."""
        self._take_first_camera_info()
        others: list[RawMessage] = []
        size = 0
        for message in self._bags.messages():
            if message.topic == self._image_topic:
                yield Step(others, message, self._frame(message))
                others, size = [], 0
                continue
            if message.topic == self._info_topic:
                info = self._bags.decode(message)
                if info is not None:
                    self._maker.take_camera_info(info)
            others.append(message)
            size += len(message.data)
            if len(others) >= _LONGEST or size >= _LARGEST:
                yield Step(others)
                others, size = [], 0
        yield Step(others)

    def _take_first_camera_info(self) -> None:
        if self._info_topic is not None:
            info = self._bags.first(self._info_topic)
            if info is not None:
                self._maker.take_camera_info(info)
                self._maker.bad_camera_infos = 0  # it will be read again

    def _frame(self, raw: RawMessage) -> Frame | None:
        message = self._bags.decode(raw)
        if message is None:  # which the bags count
            return None
        try:
            frame = self._maker.frame(message, raw.time_ns)
        except DepthPersonError as error:
            self.oddities.undecodable += 1
            self.oddities.first_undecodable = self.oddities.first_undecodable or str(error)
            return None
        self.oddities.unstamped += stamp_ns(message.header) == 0
        self.oddities.disordered += self._last_ns is not None and frame.stamp_ns < self._last_ns
        self.oddities.repeated += frame.stamp_ns in self._seen_ns
        self.oddities.uncalibrated += frame.intrinsics is None
        self._last_ns = frame.stamp_ns
        self._seen_ns.add(frame.stamp_ns)
        return frame
