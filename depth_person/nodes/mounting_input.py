"""The topics that tell of the vehicle's attitude, height and motion."""
from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

from geometry_msgs.msg import PoseStamped, TransformStamped
from nav_msgs.msg import Odometry
from rclpy.subscription import Subscription
from sensor_msgs.msg import Imu, Range
from std_msgs.msg import Float64

from depth_person.mounting.camera_state import CameraState, CameraTracker
from depth_person.mounting.vehicle_inputs import VehicleInputs
from depth_person.nodes.base import StageNode
from depth_person.nodes.monitor import Level, Monitor
from depth_person.nodes.qos import sensor_profile, transform_profile
from depth_person.settings.inputs import InputSettings

#: Name of an input and of its topic -> type, and the method that takes it.
_TOPICS: dict[str, tuple[type, str]] = {
    'imu': (Imu, 'take_imu'), 'pose': (PoseStamped, 'take_pose'),
    'odometry': (Odometry, 'take_odometry'), 'rangefinder': (Range, 'take_rangefinder'),
    'rel_alt': (Float64, 'take_rel_alt')}
#: Messages of autopilots come in bursts; more than one is needed to interpolate.
_QUEUE = 10


class MountingInput:
    """
    Subscribes to what the parameters ask for, and to nothing else.

    :param node: a node while it is being configured.
    :param settings: returns what is in force; the node's own settings when not given.
    """

    def __init__(
        self, node: StageNode[Any], settings: Callable[[], InputSettings] | None = None,
    ) -> None:
        self._node = node
        self._settings = settings or (lambda: node.settings)
        sources = self._settings().sources
        self._topics: dict[str, Subscription] = {}
        names = {name: node.resolve_topic_name(name) for name in _TOPICS}
        self._inputs = VehicleInputs(_MonitorReport(node.monitor), names)
        self._tracker = CameraTracker(_MonitorReport(node.monitor), self._inputs)
        for name in sources & _TOPICS.keys():
            kind, method = _TOPICS[name]
            self._topics[name] = self._listen(kind, name, getattr(self._inputs, method))
        if 'tf' in sources:
            self._listen_to_tf()

    def at(self, stamp_ns: int, frame_id: str) -> CameraState:
        """Return what is known of the camera at the time of an image; frame_id is the image's."""
        for name, topic in self._topics.items():
            self._inputs.refuse(name, self._node.crowded(topic))
        return self._tracker.at(stamp_ns, frame_id, self._settings())

    def _listen(
        self, kind: type, topic: str, take: Callable[..., None], **options: Any,
    ) -> Subscription:
        def locked(message: Any) -> None:
            stamp = {'stamp_ns': self._node.now_ns} if kind is Float64 else {}
            with self._tracker.lock:
                take(message, **stamp)

        options.setdefault('profile', sensor_profile(depth=_QUEUE))
        return self._node.listen(
            kind, topic, locked, optional=True, while_inactive=True, **options)

    def _listen_to_tf(self) -> None:
        """Listen to single transforms, and to TF itself where its message can be had."""
        for static in (False, True):
            self._listen_to_transforms(
                TransformStamped, 'transforms_static' if static else 'transforms', static=static)
        try:
            kind = import_module('tf2_msgs.msg').TFMessage
        except ImportError:
            self._node.monitor.fault(
                'tf', Level.WARN, '/tf cannot be heard, since this installation has no tf2_msgs '
                '(the wheels of ROS 2 lack it). Use a native ROS 2, or publish the transforms one '
                f'by one on {self._node.resolve_topic_name("transforms")} '
                '(geometry_msgs/TransformStamped)')
            return
        for static in (False, True):
            self._listen_to_transforms(kind, '/tf_static' if static else '/tf', static=static)

    def _listen_to_transforms(self, kind: type, topic: str, *, static: bool) -> None:
        def take(message: Any) -> None:
            self._node.monitor.clear('tf')
            single = isinstance(message, TransformStamped)
            self._inputs.take_transforms(
                [message] if single else message.transforms, static=static)

        self._listen(
            kind, topic, take, shared=True, profile=transform_profile(static=static))


class _MonitorReport:
    """Brings what inputs report into a node's diagnostics: they degrade, nothing more."""

    def __init__(self, monitor: Monitor) -> None:
        self._monitor = monitor
        self.clear = monitor.clear
        self.value = monitor.value

    def fault(self, key: str, message: str) -> None:
        """Report a fault."""
        self._monitor.fault(key, Level.WARN, message)

    def count(self, name: str) -> None:
        """Add one to a count."""
        self._monitor.count(name)
