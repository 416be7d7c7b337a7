"""The node that turns keypoints into distances."""
from __future__ import annotations

from collections.abc import Mapping
import time

from sensor_msgs.msg import CameraInfo, CompressedImage, Image, PointCloud2
from std_msgs.msg import Header
from visualization_msgs.msg import MarkerArray

from depth_person.camera.frame import Frame
from depth_person.camera.intrinsics import Intrinsics
from depth_person.distance.stage import DistanceStage
from depth_person.distance.tracked import TrackedPeople
from depth_person.errors import DepthPersonError
from depth_person.nodes.autopilot_outputs import AutopilotOutputs
from depth_person.nodes.base import StageNode
from depth_person.nodes.calibration_input import CalibrationInput
from depth_person.nodes.cloud_messages import decode_people, encode_distances
from depth_person.nodes.image_input import ImageInput
from depth_person.nodes.image_messages import header, image_size, stamp_ns
from depth_person.nodes.marker_messages import encode_markers
from depth_person.nodes.monitor import Level
from depth_person.nodes.mounting_input import MountingInput
from depth_person.nodes.overlay_output import OverlayOutput
from depth_person.nodes.watchdog import Age, Watchdog
from depth_person.pose.people import People
from depth_person.settings.depth import DepthSettings
from depth_person.settings.parameter import ParameterValue


class DepthNode(StageNode[DepthSettings]):
    """
    Publishes person_depth (markers), its people (numbers), scan, nearest, target and overlay.

    :param listen: whether keypoints come over a topic; otherwise `take` is called with them.
    :raises DepthPersonError: when parameters are wrong.
    """

    def __init__(
        self, *, overrides: Mapping[str, ParameterValue] | None = None, listen: bool = True,
    ) -> None:
        super().__init__('depth_node', DepthSettings, overrides=overrides)
        self._listen = listen
        self._watchdog = Watchdog(self.monitor)

    def configure(self) -> None:
        """Make the distance stage and the topics."""
        self._stage = DistanceStage(self.settings.distance_options())
        self._markers = self.advertise(MarkerArray, 'person_depth')
        self._people = self.advertise(PointCloud2, 'person_depth/people')
        self._overlay = OverlayOutput(self)
        self._autopilot = AutopilotOutputs(self)
        self._images = ImageInput(
            self, self._on_image, compressed=self.settings.compressed, optional=True)
        self._calibration = CalibrationInput(
            self.monitor, topic=self.resolve_topic_name('camera_info'))
        self._mounting = MountingInput(self)
        if not self._listen:
            self._handed_over_people = self.expect('pose_node')
        else:
            self.listen(CameraInfo, 'camera_info', self._on_camera_info, while_inactive=True)
            self.listen(PointCloud2, 'person_keypoints', self._on_keypoints)
            self._images.open()  # one image tells the resolution that camera_info must have

    @property
    def has_subscribers(self) -> bool:
        """Whether anyone awaits the results."""
        return self.active and (self._overlay.wanted or self._autopilot.wanted or any(
            publisher.get_subscription_count() for publisher in (self._markers, self._people)))

    def settings_changed(self) -> None:
        """Compute with the new settings from the next frame on."""
        options = self.settings.distance_options()
        if options != self._stage.options:  # which forgets everybody
            self._stage = DistanceStage(options)

    def _check(self) -> None:
        super()._check()
        if self.active:
            self._autopilot.check()

    def activate(self) -> None:
        """Forget the people of before."""
        self._stage = DistanceStage(self.settings.distance_options())
        self._overlay.forget()
        self._autopilot.forget()

    def take(self, frame: Frame, people: People) -> None:
        """Measure the people of a frame that is handed over in memory."""
        if not self.active:
            return
        self._handed_over_people.receive()
        image_header = header(stamp_ns=frame.stamp_ns, frame_id=frame.frame_id)
        result = self._measure(people, image_header, frame.intrinsics)
        if result is not None and self._overlay.wanted:
            self._overlay.draw(frame, result)

    def _on_camera_info(self, message: CameraInfo) -> None:
        if self._calibration.take(message):
            self._images.open()  # what it belongs to may have changed too

    def _on_image(self, message: Image | CompressedImage) -> None:
        try:
            self._calibration.take_image_size(*image_size(message))
        except DepthPersonError as error:
            self.monitor.count('bad images')
            self.monitor.fault('image', Level.WARN, str(error))
            return
        self.monitor.clear('image')
        if self._overlay.wanted:
            self._overlay.take_image(message)
        else:
            self._images.close()

    def _on_keypoints(self, message: PointCloud2) -> None:
        try:
            people = decode_people(message, convention=self.settings.convention)
        except DepthPersonError as error:
            self.monitor.count('bad keypoint messages')
            self.monitor.fault('keypoints', Level.ERROR, str(error))
            return
        self.monitor.clear('keypoints')
        intrinsics = self._calibration.intrinsics_for(message.header.frame_id)
        result = self._measure(people, message.header, intrinsics)
        if result is None:
            return
        if self._overlay.wanted:
            self._images.open()
            self._overlay.take_result(
                result, intrinsics, stamp_ns=stamp_ns(message.header))
        else:
            self._overlay.forget()

    def _measure(
        self, people: People, image_header: Header, intrinsics: Intrinsics | None,
    ) -> TrackedPeople | None:
        """Publish how far the people of one image are; None if that came too late."""
        started = time.monotonic()
        image_stamp_ns = stamp_ns(image_header)
        camera = self._mounting.at(image_stamp_ns, image_header.frame_id)
        tracked = self._stage.measure(
            people, intrinsics, camera.mounting, stamp_ns=image_stamp_ns,
            camera_pose=camera.pose)
        age = self._watchdog.judge(
            stamp_ns=image_stamp_ns, now_ns=self.now_ns, max_age_s=self.settings.max_age)
        if age is Age.STALE:
            return None
        self._people.publish(encode_distances(tracked, image_header))
        if age is Age.FRESH:  # whoever flies by it cannot see how old it is
            self._autopilot.publish(
                tracked, image_header, intrinsics, camera.mounting, camera.on_body)
        if self._markers.get_subscription_count():  # they take the longest, for who looks on
            self._markers.publish(encode_markers(tracked, image_header, intrinsics))
        self.monitor.frame()
        self.monitor.count('people', len(tracked))
        self.monitor.count('people predicted', int(tracked.predicted.sum()))
        self.monitor.count('people without range', int((~tracked.distances.known).sum()))
        self.monitor.sample('processing', time.monotonic() - started)
        self.monitor.latency(stamp_ns=image_stamp_ns, now_ns=self.now_ns)
        return tracked
