"""The picture with skeletons and distances, drawn only while someone watches."""
from __future__ import annotations

from typing import Any

from sensor_msgs.msg import CompressedImage, Image

from depth_person.camera.frame import Frame
from depth_person.camera.intrinsics import Intrinsics
from depth_person.distance.tracked import TrackedPeople
from depth_person.errors import DepthPersonError
from depth_person.nodes.base import StageNode
from depth_person.nodes.image_messages import decode_image, encode_jpeg, header, stamp_ns
from depth_person.nodes.monitor import Level
from depth_person.nodes.worker import Mailbox
from depth_person.overlay import draw

#: How many images or results wait for the other of the same stamp.
_WAITING = 5


class OverlayOutput:
    """
    Publishes person_depth/image/compressed from a thread of its own.

    :param node: whose settings have jpeg_quality.
    """

    def __init__(self, node: StageNode[Any]) -> None:
        self._node = node
        self._publisher = node.advertise(CompressedImage, 'person_depth/image/compressed')
        self._images: dict[int, Image | CompressedImage] = {}
        self._results: dict[int, tuple[TrackedPeople, Intrinsics | None]] = {}
        self._mailbox: Mailbox[tuple[
            Frame | Image | CompressedImage, TrackedPeople, Intrinsics | None]] = (
            node.consume('overlay', self._publish_or_report))

    @property
    def wanted(self) -> bool:
        """Whether anyone subscribes."""
        return self._publisher.get_subscription_count() > 0

    def draw(self, frame: Frame, result: TrackedPeople) -> None:
        """Leave a frame and what it shows; an older one that is not drawn yet is dropped."""
        self._mailbox.put((frame, result, frame.intrinsics))

    def take_image(self, message: Image | CompressedImage) -> None:
        """Take an image; it is drawn with the result of the same stamp."""
        self._images[stamp_ns(message.header)] = message
        self._match(stamp_ns(message.header))

    def take_result(
        self, result: TrackedPeople, intrinsics: Intrinsics | None, *, stamp_ns: int,
    ) -> None:
        """Take a result; it is drawn into the image of the same stamp."""
        self._results[stamp_ns] = result, intrinsics
        self._match(stamp_ns)

    def forget(self) -> None:
        """Drop what waits for its other half."""
        self._images.clear()
        self._results.clear()

    def _publish_or_report(
        self, shown: tuple[
            Frame | Image | CompressedImage, TrackedPeople, Intrinsics | None],
    ) -> None:
        try:
            self._publish(*shown)
        except DepthPersonError as error:
            self._node.monitor.fault('overlay', Level.WARN, f'no overlay: {error}')
        else:
            self._node.monitor.clear('overlay')

    def _match(self, stamp: int) -> None:
        if stamp in self._images and stamp in self._results:
            self._mailbox.put((self._images.pop(stamp), *self._results.pop(stamp)))
        for waiting in (self._images, self._results):
            while len(waiting) > _WAITING:
                del waiting[next(iter(waiting))]

    def _publish(
        self, image: Frame | Image | CompressedImage, result: TrackedPeople,
        intrinsics: Intrinsics | None,
    ) -> None:
        frame = image if isinstance(image, Frame) else decode_image(image)
        canvas = frame.image.copy()
        draw(canvas, result, intrinsics)
        self._publisher.publish(encode_jpeg(
            canvas, header(stamp_ns=frame.stamp_ns, frame_id=frame.frame_id),
            quality=self._node.settings.jpeg_quality))
