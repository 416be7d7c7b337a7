"""Results as the nodes publish them, for bags instead of topics."""
from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, cast

from rclpy.qos import QoSProfile
from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)

from depth_person.camera.bag_types import jazzy_types
from depth_person.camera.frame import Frame
from depth_person.distance.tracked import TrackedPeople
from depth_person.mounting.camera_state import CameraState
from depth_person.nodes.autopilot_outputs import AutopilotOutputs
from depth_person.nodes.cloud_messages import encode_distances, encode_people
from depth_person.nodes.image_messages import header
from depth_person.nodes.marker_messages import encode_markers
from depth_person.nodes.monitor import Monitor
from depth_person.nodes.qos import publisher_profile
from depth_person.pose.people import People
from depth_person.replay.cdr import Serializer
from depth_person.replay.process import ResultTopic
from depth_person.settings.depth import DepthSettings

#: What rosbag2 writes for a time that never comes.
_NEVER = QosTime(9223372036, 854775807)
_KEYPOINTS, _PEOPLE, _MARKERS = 'person_keypoints', 'person_depth/people', 'person_depth'


class ResultCodec:
    """
    Serialises what pose_node and depth_node publish for a frame.

    :param namespace: of the nodes, with a slash at its end.
    :ivar topics: by name.
    """

    def __init__(self, settings: DepthSettings, *, namespace: str = '/') -> None:
        self._namespace = namespace
        self._serializer = Serializer(jazzy_types())
        self._published: list[tuple[str, Any]] = []
        self.topics: dict[str, ResultTopic] = {}
        for name, msgtype in ((_KEYPOINTS, 'sensor_msgs/msg/PointCloud2'),
                              (_PEOPLE, 'sensor_msgs/msg/PointCloud2'),
                              (_MARKERS, 'visualization_msgs/msg/MarkerArray')):
            self._add(name, msgtype)
        self._autopilot = AutopilotOutputs(cast(Any, _Host(settings, self._advertise)))

    @property
    def keypoint_topic(self) -> str:
        """The topic of the keypoints."""
        return self._namespace + _KEYPOINTS

    def encode(
        self, frame: Frame, people: People, tracked: TrackedPeople, camera: CameraState,
    ) -> Iterator[tuple[str, bytes]]:
        """Yield topic and serialised message of everything that a frame gives."""
        image_header = header(stamp_ns=frame.stamp_ns, frame_id=frame.frame_id)
        self._published = [
            (self._namespace + _KEYPOINTS, encode_people(people, image_header)),
            (self._namespace + _PEOPLE, encode_distances(tracked, image_header)),
            (self._namespace + _MARKERS,
             encode_markers(tracked, image_header, frame.intrinsics))]
        self._autopilot.publish(
            tracked, image_header, frame.intrinsics, camera.mounting, camera.on_body)
        for topic, message in self._published:
            yield topic, self._serializer.serialize(message, self.topics[topic].msgtype)

    def _add(self, name: str, msgtype: str) -> str:
        topic = self._namespace + name
        self.topics[topic] = ResultTopic(msgtype, (recorded_profile(publisher_profile()),))
        return topic

    def _advertise(self, message_type: type, name: str) -> _Publisher:
        package = message_type.__module__.partition('.')[0]
        topic = self._add(name, f'{package}/msg/{message_type.__name__}')
        return _Publisher(lambda message: self._published.append((topic, message)))


class _Host:
    """As much of a node as what publishes results asks of one."""

    def __init__(
        self, settings: DepthSettings, advertise: Callable[[type, str], _Publisher],
    ) -> None:
        self.settings = settings
        self.advertise = advertise
        self.monitor = Monitor(lambda level, message: None)


class _Publisher:
    """Takes messages as a publisher does."""

    def __init__(self, publish: Callable[[Any], None]) -> None:
        self.publish = publish


def recorded_profile(profile: QoSProfile) -> Qos:
    """Return a profile as the metadata of bags hold it."""
    return Qos(
        QosHistory[profile.history.name], profile.depth,
        QosReliability[profile.reliability.name], QosDurability[profile.durability.name],
        _NEVER, _NEVER, QosLiveliness.AUTOMATIC, _NEVER,
        profile.avoid_ros_namespace_conventions)
