"""The camera's attitude, height and place from what was recorded with its images."""
from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from functools import partial
import logging
from typing import Any

from depth_person.errors import DepthPersonError
from depth_person.mounting.camera_state import CameraState, CameraTracker
from depth_person.mounting.vehicle_inputs import VehicleInputs
from depth_person.replay.input_bags import InputBags, RawMessage
from depth_person.settings.inputs import InputSettings

LOG = logging.getLogger(__name__)
#: Name of an input and of its topic -> type, and the method that takes it.
_TYPES = {
    'imu': ('sensor_msgs/msg/Imu', 'take_imu'),
    'pose': ('geometry_msgs/msg/PoseStamped', 'take_pose'),
    'odometry': ('nav_msgs/msg/Odometry', 'take_odometry'),
    'rangefinder': ('sensor_msgs/msg/Range', 'take_rangefinder'),
    'rel_alt': ('std_msgs/msg/Float64', 'take_rel_alt'),
}
_TRANSFORM, _TRANSFORMS = 'geometry_msgs/msg/TransformStamped', 'tf2_msgs/msg/TFMessage'
#: Names of the inputs that parameters ask for by `tf`.
_OF_TF = ('tf', 'tf_static', 'transforms', 'transforms_static')
#: What is reported of an input for being what it is.
_REMARKS = ('rel_alt',)

Taker = Callable[[Any, int], None]


class Surroundings:
    """
    Takes from bags what depth_node would subscribe to, and knows what it would know by that.

    A topic that is missing under its name is taken to be the only one of its type.

    :param namespace: of the node, with a slash at its end.
    :param remaps: names that the node's topics have in the bags, by their own.
    :raises DepthPersonError: when a topic may be one of several, or a remapped one is not there.
    """

    def __init__(
        self, bags: InputBags, settings: InputSettings, *, namespace: str = '/',
        remaps: Mapping[str, str] | None = None,
    ) -> None:
        self._bags = bags
        self._settings = settings
        self._names = {name: namespace + name for name in (*_TYPES, *_OF_TF)}
        self._names.update({'tf': '/tf', 'tf_static': '/tf_static'})
        for name, topic in (remaps or {}).items():
            self._remap(name, '/' + topic.lstrip('/'))
        self.report = CountingReport()
        self._takers: dict[str, Taker] = {}
        wanted = settings.sources
        topics = {name: self._find(name) for name in _TYPES if name in wanted}
        self._inputs = VehicleInputs(self.report, topics)
        self._tracker = CameraTracker(self.report, self._inputs)
        for name, topic in topics.items():
            self._takers[topic] = self._taker(name)
        if 'tf' in wanted:
            self._takers |= dict(self._transform_takers())

    def take(self, message: RawMessage) -> None:
        """Take a message, if it is of a topic that tells anything."""
        taker = self._takers.get(message.topic)
        if taker is None:
            return
        decoded = self._bags.decode(message)
        if decoded is not None:
            taker(decoded, message.time_ns)

    def at(self, stamp_ns: int, frame_id: str) -> CameraState:
        """Return what is known of the camera at the time of an image of this frame."""
        return self._tracker.at(stamp_ns, frame_id, self._settings)

    def _remap(self, name: str, topic: str) -> None:
        if name not in self._names:
            raise DepthPersonError(
                f'--remap {name}: depth_node has no such input; it has {", ".join(self._names)}')
        source = 'tf' if name in _OF_TF else name
        if source not in self._settings.sources:
            LOG.warning('--remap %s changes nothing: none of the parameters attitude, mounting, '
                        'height and camera_pose is %s', name, source)
            return
        msgtypes = (_TRANSFORMS, _TRANSFORM) if name in _OF_TF else _TYPES[name][:1]
        candidates = [each.name for each in self._bags.topics.values() if each.msgtype in msgtypes]
        if topic not in candidates:
            raise DepthPersonError(
                f'--remap {name}: {self._bags.description} has no {topic} of type '
                f'{" or ".join(msgtypes)}; it has {", ".join(candidates) or "none"}')
        self._names[name] = topic

    def _find(self, name: str) -> str:
        msgtype, _ = _TYPES[name]
        topic = self._names[name]
        known = self._bags.topics
        if topic in known and known[topic].msgtype == msgtype:
            return topic
        others = [each.name for each in known.values() if each.msgtype == msgtype]
        if len(others) > 1:
            raise DepthPersonError(
                f'{self._bags.description} has no {topic} of type {msgtype}, but '
                f'{", ".join(others)}; choose by --remap {name}:=TOPIC')
        return others[0] if others else topic

    def _taker(self, name: str) -> Taker:
        take = getattr(self._inputs, _TYPES[name][1])
        if name == 'rel_alt':  # has no stamp of its own
            return lambda message, time_ns: take(message, stamp_ns=time_ns)
        return lambda message, _: take(message)

    def _transform_takers(self) -> Iterator[tuple[str, Taker]]:
        for name in _OF_TF:
            topic = self._names[name]
            if topic in self._bags.topics:
                yield topic, partial(
                    self._take_transforms, self._bags.topics[topic].msgtype,
                    name.endswith('_static'))

    def _take_transforms(self, msgtype: str, static: bool, message: Any, _: int) -> None:
        if msgtype == _TRANSFORMS:
            self._inputs.take_transforms(message.transforms, static=static)
        elif msgtype == _TRANSFORM:
            self._inputs.take_transforms([message], static=static)


class CountingReport:
    """Counts what inputs report, with the first words of each."""

    def __init__(self) -> None:
        self._counts: Counter[str] = Counter()
        self._words: dict[str, str] = {}

    @property
    def faults(self) -> list[str]:
        """What was missing or wrong, and how often."""
        return [f'{count} times: {self._words[key]}'
                for key, count in self._counts.items() if key not in _REMARKS]

    @property
    def remarks(self) -> list[str]:
        """What is to be known of inputs that are neither missing nor wrong."""
        return [self._words[key] for key in self._counts if key in _REMARKS]

    def fault(self, key: str, message: str) -> None:
        """Count a fault."""
        self._counts[key] += 1
        self._words.setdefault(key, message)

    def clear(self, key: str) -> None:
        """Go on: a fault has been counted."""

    def count(self, name: str) -> None:
        """Go on: what is counted here is reported as a fault, too."""

    def value(self, name: str, text: str) -> None:
        """Go on: the figures of one moment say nothing of a whole bag."""
