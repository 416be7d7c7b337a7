"""The messages of a vehicle, checked and kept with their stamps."""
from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
import math
from typing import Any

import numpy as np

from depth_person.distance.attitude import rotation_from
from depth_person.errors import DepthPersonError
from depth_person.mounting.history import (
    blend_numbers,
    blend_poses,
    Found,
    History,
    NotKnown,
    Pose,
    Taken,
)
from depth_person.mounting.report import Report
from depth_person.mounting.transforms import TransformBuffer

#: How long an attitude, and a height, goes on after its newest sample, seconds.
_POSE_REACH_S = 0.1
_NUMBER_REACH_S = 0.5
_POSES = ('imu', 'pose', 'odometry')
_NUMBERS = ('rangefinder', 'rel_alt')


class VehicleInputs:
    """
    Takes messages as ROS or a bag reader gives them: only their fields count.

    A message that cannot be right is reported, counted and left out. Stamps that jump back say
    that a clock was set or a recording began anew: what was known before is forgotten.

    :param names: name of an input -> of its topic, for messages.
    """

    def __init__(self, report: Report, names: Mapping[str, str] | None = None) -> None:
        self._report = report
        self._names = dict(names or {})
        self._poses = {name: History(blend_poses, reach_s=_POSE_REACH_S) for name in _POSES}
        self._numbers = {
            name: History(blend_numbers, reach_s=_NUMBER_REACH_S) for name in _NUMBERS}
        self._transforms = TransformBuffer()
        self._refused: dict[str, str] = {}

    def take_imu(self, message: Any) -> None:
        """Take the orientation of a sensor_msgs/Imu."""
        def add() -> Taken:
            if message.orientation_covariance[0] == -1:
                raise DepthPersonError('it holds no orientation; choose a topic that does')
            pose = Pose(_rotation(message.orientation), np.zeros(3))
            return self._poses['imu'].add(_stamp_ns(message.header), pose)

        self._take('imu', add)

    def take_pose(self, message: Any) -> None:
        """Take a geometry_msgs/PoseStamped of the vehicle in a frame whose z is up."""
        self._take('pose', lambda: self._poses['pose'].add(
            _stamp_ns(message.header), _pose(message.pose)))

    def take_odometry(self, message: Any) -> None:
        """Take a nav_msgs/Odometry of the vehicle in a frame whose z is up."""
        self._take('odometry', lambda: self._poses['odometry'].add(
            _stamp_ns(message.header), _pose(message.pose.pose)))

    def take_rangefinder(self, message: Any) -> None:
        """Take a sensor_msgs/Range of a sensor that looks down from the vehicle."""
        def add() -> Taken:
            distance = message.range
            # -inf is too near, +inf too far, NaN unknown (REP 117).
            if not (math.isfinite(distance) and message.min_range <= distance
                    <= message.max_range):
                raise DepthPersonError(
                    f'{distance:g} m is not within {message.min_range:g} to '
                    f'{message.max_range:g} m, which the sensor can tell')
            return self._numbers['rangefinder'].add(_stamp_ns(message.header), distance)

        self._take('rangefinder', add)

    def take_rel_alt(self, message: Any, *, stamp_ns: int) -> None:
        """Take a std_msgs/Float64, which has no stamp, as of this time."""
        def add() -> Taken:
            if not math.isfinite(message.data):
                raise DepthPersonError(f'{message.data:g} is no height')
            return self._numbers['rel_alt'].add(stamp_ns, message.data)

        self._take('rel_alt', add)

    def take_transforms(self, messages: Iterable[Any], *, static: bool = False) -> None:
        """Take geometry_msgs/TransformStamped, as in a tf2_msgs/TFMessage."""
        for message in messages:
            self._take('tf', lambda message=message: self._transforms.add(  # type: ignore[misc]
                parent=message.header.frame_id, child=message.child_frame_id,
                stamp_ns=_stamp_ns(message.header), static=static,
                pose=Pose(_rotation(message.transform.rotation),
                          _vector(message.transform.translation))))

    def refuse(self, name: str, reason: str) -> None:
        """Do not use an input until the reason is empty."""
        self._refused[name] = reason

    def pose_at(self, name: str, stamp_ns: int) -> Found[Pose]:
        """Return where the vehicle is; raise NotKnown, naming the topic."""
        return self._found(name, self._poses[name], stamp_ns)

    def number_at(self, name: str, stamp_ns: int) -> Found[float]:
        """Return what a height sensor says; raise NotKnown, naming the topic."""
        return self._found(name, self._numbers[name], stamp_ns)

    def transform_at(self, *, target: str, source: str, stamp_ns: int) -> Found[Pose]:
        """Return one frame as seen from another; raise NotKnown, naming the frames."""
        found = self._transforms.lookup(target=target, source=source, stamp_ns=stamp_ns)
        self._report.value('tf age', f'{1000 * found.beyond_s:.0f} ms')
        self._report.clear('clock of tf')
        return found

    def name_of(self, name: str) -> str:
        """Return what an input is called in messages."""
        return self._names.get(name, name)

    def _found(self, name: str, history: History[Any], stamp_ns: int) -> Found[Any]:
        topic = self.name_of(name)
        if refusal := self._refused.get(name):
            raise NotKnown(f'{topic} is not used: {refusal}')
        try:
            found = history.at(stamp_ns)
        except NotKnown as reason:
            self._report.value(f'{name} age', str(reason))
            raise NotKnown(
                f'no sample on {topic} at the time of the image: {reason}. Check the topic, its '
                'rate, and that both clocks are the same') from reason
        self._report.value(f'{name} age', f'{1000 * found.beyond_s:.0f} ms')
        self._report.clear(f'clock of {name}')
        return found

    def _take(self, name: str, add: Callable[[], Taken]) -> None:
        topic = self.name_of(name)
        try:
            taken = add()
        except DepthPersonError as error:
            self._report.count(f'bad {name} messages')
            self._report.fault(f'bad {name}', f'{topic}: {error}')
            return
        self._report.clear(f'bad {name}')
        if taken is Taken.LATE:
            self._report.count(f'late {name} messages')
        elif taken is Taken.JUMPED:
            self._report.count('clock jumps')
            self._report.fault(
                f'clock of {name}', f'the stamps of {topic} have jumped back; what it told '
                'before is forgotten')


def _stamp_ns(header: Any) -> int:
    return int(header.stamp.sec) * 10**9 + int(header.stamp.nanosec)


def _rotation(quaternion: Any) -> np.ndarray:
    return rotation_from((quaternion.x, quaternion.y, quaternion.z, quaternion.w))


def _vector(vector: Any) -> np.ndarray:
    result = np.array([vector.x, vector.y, vector.z], np.float64)
    if not np.isfinite(result).all():
        raise DepthPersonError('a position is not finite')
    return result


def _pose(pose: Any) -> Pose:
    return Pose(_rotation(pose.orientation), _vector(pose.position))
