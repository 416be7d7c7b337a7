"""Results as the nodes publish them, for bags instead of topics."""
from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from rclpy.qos import QoSProfile
from rclpy.serialization import serialize_message
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
from depth_person.distance.estimator import Mounting
from depth_person.distance.tracked import TrackedPeople
from depth_person.nodes.cloud_messages import encode_distances, encode_people
from depth_person.nodes.image_messages import header
from depth_person.nodes.marker_messages import encode_markers
from depth_person.nodes.qos import publisher_profile
from depth_person.pose.people import People
from depth_person.replay.process import ResultTopic

#: What rosbag2 writes for a time that never comes.
_NEVER = QosTime(9223372036, 854775807)
KEYPOINTS = 'person_keypoints'


class ResultCodec:
    """
    Serialises what pose_node and depth_node publish for a frame.

    :param namespace: of the nodes.
    """

    def __init__(self, namespace: str = '/') -> None:
        self._prefix = f'/{namespace.strip("/")}/'.replace('//', '/')
        self._types = jazzy_types()
        qos = (recorded_profile(publisher_profile()),)
        self.topics = {
            self._prefix + name: ResultTopic(msgtype, qos) for name, msgtype in (
                (KEYPOINTS, 'sensor_msgs/msg/PointCloud2'),
                ('person_depth/people', 'sensor_msgs/msg/PointCloud2'),
                ('person_depth', 'visualization_msgs/msg/MarkerArray'),
            )}

    @property
    def keypoint_topic(self) -> str:
        """The topic of the keypoints."""
        return self._prefix + KEYPOINTS

    def encode(
        self, frame: Frame, people: People, tracked: TrackedPeople, mounting: Mounting,
    ) -> Iterator[tuple[str, bytes]]:
        """Yield topic and serialised message of everything that a frame gives."""
        image_header = header(stamp_ns=frame.stamp_ns, frame_id=frame.frame_id)
        messages = (
            encode_people(people, image_header), encode_distances(tracked, image_header),
            encode_markers(tracked, image_header, frame.intrinsics))
        for (topic, result), message in zip(self.topics.items(), messages, strict=True):
            yield topic, self._serialized(message, result.msgtype)

    def _serialized(self, message: Any, msgtype: str) -> bytes:
        """Return a message's bytes, the same for the same message."""
        # Fast CDR leaves whatever the memory held before in the gaps between fields.
        fields = self._types.deserialize_cdr(serialize_message(message), msgtype)
        return bytes(self._types.serialize_cdr(fields, msgtype))


def recorded_profile(profile: QoSProfile) -> Qos:
    """Return a profile as the metadata of bags hold it; what is not said is the default."""
    return Qos(
        QosHistory[profile.history.name], profile.depth,
        QosReliability[profile.reliability.name], QosDurability[profile.durability.name],
        _NEVER, _NEVER, QosLiveliness.AUTOMATIC, _NEVER,
        profile.avoid_ros_namespace_conventions)
