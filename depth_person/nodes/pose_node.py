"""The node that finds people in images."""
from __future__ import annotations

from collections.abc import Callable, Mapping
import time

from sensor_msgs.msg import CompressedImage, Image, PointCloud2

from depth_person.camera.frame import Frame
from depth_person.errors import DepthPersonError
from depth_person.nodes.base import StageNode
from depth_person.nodes.cloud_messages import encode_people
from depth_person.nodes.image_input import ImageInput
from depth_person.nodes.image_messages import decode_image, header
from depth_person.nodes.monitor import Level
from depth_person.nodes.worker import Mailbox
from depth_person.pose.people import People
from depth_person.pose.pipeline import PoseEstimator
from depth_person.settings.parameter import ParameterValue
from depth_person.settings.pose import PoseSettings

#: How long the last frame may take when the node is closed.
_DRAIN_S = 2.0


class PoseNode(StageNode[PoseSettings]):
    """
    Publishes person_keypoints for the newest image whenever the network is free.

    :param deliver: takes every frame and its people in memory.
    :param listen: whether images come over a topic; otherwise `take` is called with frames.
    :raises DepthPersonError: when parameters are wrong. A model that is not installed keeps it
        from being configured.
    """

    def __init__(
        self, *, overrides: Mapping[str, ParameterValue] | None = None,
        deliver: Callable[[Frame, People], None] | None = None, listen: bool = True,
    ) -> None:
        super().__init__('pose_node', PoseSettings, overrides=overrides)
        self._deliver = deliver
        self._listen = listen

    def configure(self) -> None:
        """Load the network, and make the topics."""
        self._estimator = PoseEstimator(self.settings.pose_options())
        if self._estimator.warning:
            self.monitor.fault('provider', Level.WARN, self._estimator.warning)
        self._keypoints = self.advertise(PointCloud2, 'person_keypoints')
        self._mailbox: Mailbox[Frame | Image | CompressedImage] = self.consume(
            'pose', self._process)
        if self._listen:
            ImageInput(self, self._take, compressed=self.settings.compressed).open()
        else:
            self._handed_over_frames = self.expect('camera_node')

    def take(self, frame: Frame) -> None:
        """Take a frame that is handed over in memory."""
        if self.active:
            self._handed_over_frames.receive()
            self._take(frame)

    def _take(self, image: Frame | Image | CompressedImage) -> None:
        """Leave an image for the network; what it has not got to is dropped for a newer one."""
        if self._mailbox.put(image):
            self.monitor.count('dropped frames')

    def close(self) -> None:
        """Finish the last frame, then stop."""
        deadline = time.monotonic() + _DRAIN_S
        while self.active and not self._mailbox.idle and time.monotonic() < deadline:
            time.sleep(0.01)
        super().close()

    def _process(self, image: Frame | Image | CompressedImage) -> None:
        started = time.monotonic()
        try:
            frame = image if isinstance(image, Frame) else decode_image(image)
            people = self._estimator.estimate(frame)
        except DepthPersonError as error:
            self.monitor.count('bad images')
            self.monitor.fault('image', Level.ERROR, str(error))
            return
        if not self.active:
            return
        self.monitor.clear('image')
        image_header = header(stamp_ns=frame.stamp_ns, frame_id=frame.frame_id)
        self._keypoints.publish(encode_people(people, image_header))
        self.monitor.frame()
        self.monitor.count('people', len(people))
        self.monitor.value('convention', people.convention)
        self.monitor.sample('inference', self._estimator.inference_s)
        self.monitor.sample('processing', time.monotonic() - started)
        self.monitor.latency(stamp_ns=frame.stamp_ns, now_ns=self.now_ns)
        if self._deliver is not None:
            self._deliver(frame, people)
