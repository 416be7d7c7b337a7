"""The camera's attitude and height from what was recorded with its images."""
from __future__ import annotations

from collections.abc import Mapping
import logging

from rclpy.serialization import deserialize_message
from sensor_msgs.msg import Imu

from depth_person.distance.estimator import Mounting
from depth_person.distance.tracked import CameraPose
from depth_person.nodes.attitude_input import AttitudeInput
from depth_person.nodes.monitor import Level, Monitor
from depth_person.replay.input_bags import RawMessage
from depth_person.settings.depth import DepthSettings

LOG = logging.getLogger(__name__)


class RecordedSurroundings:
    """
    Takes the messages that depth_node subscribes to, and knows what it would know by them.

    :param namespace: of the node.
    :param remaps: names that the node's topics have in the bags, by their own.
    :ivar topics: those that it takes messages of.
    """

    def __init__(
        self, settings: DepthSettings, namespace: str, remaps: Mapping[str, str],
    ) -> None:
        prefix = f'/{namespace.strip("/")}/'.replace('//', '/')
        imu = remaps.get('imu', prefix + 'imu')
        self._settings = settings
        self._attitude = AttitudeInput(Monitor(_log), topic=imu)
        self.topics = frozenset([imu] if settings.attitude == 'imu' else [])

    def take(self, message: RawMessage) -> None:
        """Take a message of one of the topics."""
        self._attitude.take(deserialize_message(message.data, Imu))

    def at(self, stamp_ns: int) -> tuple[Mounting, CameraPose | None]:
        """Return what is known at the time of an image."""
        return self._attitude.mounting_at(stamp_ns, self._settings), None


def _log(level: Level, message: str) -> None:
    LOG.log(logging.ERROR if level == Level.ERROR else logging.WARNING, '%s', message)
