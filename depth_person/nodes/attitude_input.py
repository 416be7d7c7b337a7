"""The camera's attitude and height at the time of an image, from parameters and an Imu."""
from __future__ import annotations

from collections import deque
from dataclasses import dataclass
import math

import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import Imu

from depth_person.distance.attitude import body_gravity, level_gravity, optical_from_body
from depth_person.distance.estimator import Mounting
from depth_person.errors import DepthPersonError
from depth_person.nodes.image_messages import stamp_ns
from depth_person.nodes.monitor import Level, Monitor
from depth_person.settings.depth import DepthSettings

_FAULT = 'imu'
#: An Imu that is further from an image than this tells nothing of it, nanoseconds.
_LATEST_NS = 100_000_000
#: Messages kept: more than a second of the fastest autopilots.
_KEPT = 400


@dataclass(frozen=True, eq=False)
class _Attitude:
    stamp_ns: int
    down: NDArray[np.float64]  # in the body's frame


class AttitudeInput:
    """
    Knows which way is down in each image, as far as the parameters allow.

    :param topic: of the Imu, for messages.
    """

    def __init__(self, monitor: Monitor, *, topic: str) -> None:
        self._monitor = monitor
        self._topic = topic
        self._attitudes: deque[_Attitude] = deque(maxlen=_KEPT)

    def take(self, message: Imu) -> None:
        """Take the body's orientation."""
        orientation = message.orientation
        try:
            if message.orientation_covariance[0] == -1:
                raise DepthPersonError('it holds no orientation; choose a topic that does')
            down = body_gravity((orientation.x, orientation.y, orientation.z, orientation.w))
        except DepthPersonError as error:
            self._monitor.count('bad imu messages')
            self._monitor.fault(_FAULT, Level.WARN, f'{self._topic}: {error}')
            return
        self._attitudes.append(_Attitude(stamp_ns(message.header), down))

    def mounting_at(self, image_stamp_ns: int, settings: DepthSettings) -> Mounting:
        """Return what is known of the camera at the time of an image."""
        gravity = self._gravity(image_stamp_ns, settings)
        if gravity is None:
            return Mounting()
        return Mounting(
            gravity=gravity, gravity_sigma=math.radians(settings.attitude_sigma),
            height=settings.camera_height or None, height_sigma=settings.camera_height_sigma)

    def _gravity(
        self, image_stamp_ns: int, settings: DepthSettings,
    ) -> NDArray[np.float64] | None:
        pitch, roll = math.radians(settings.camera_pitch), math.radians(settings.camera_roll)
        if settings.attitude == 'fixed':
            return level_gravity(pitch_down=pitch, roll_cw=roll)
        if settings.attitude == 'unknown':
            return None
        nearest = min(
            tuple(self._attitudes), default=None,
            key=lambda attitude: abs(attitude.stamp_ns - image_stamp_ns))
        if nearest is None or abs(nearest.stamp_ns - image_stamp_ns) > _LATEST_NS:
            self._monitor.fault(
                _FAULT, Level.WARN, f'no attitude on {self._topic} within 0.1 s of the image; '
                'distances go without. Check the topic and that both clocks are the same')
            return None
        self._monitor.clear(_FAULT)
        return optical_from_body(pitch_down=pitch, roll_cw=roll) @ nearest.down
