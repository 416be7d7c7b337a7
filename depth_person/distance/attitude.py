"""Which way is down, as the camera sees it."""
from __future__ import annotations

from collections.abc import Sequence
import math

import cv2
import numpy as np
from numpy.typing import NDArray

from depth_person.errors import DepthPersonError

_Array = NDArray[np.float64]

#: By how much the length of a quaternion may differ from 1.
_UNIT = 0.02


def optical_from_body(*, pitch_down: float, roll_cw: float) -> _Array:
    """
    Return the (3, 3) rotation from a body's frame to that of a camera mounted on it.

    The body's x is forward, y left, z up, the camera's x right, y down, z forward (REP 103). The
    camera looks forward, pitched down and then rolled clockwise as seen from behind, radians.
    """
    sin_pitch, cos_pitch = math.sin(pitch_down), math.cos(pitch_down)
    sin_roll, cos_roll = math.sin(roll_cw), math.cos(roll_cw)
    forward = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
    pitch = np.array([[1.0, 0.0, 0.0], [0.0, cos_pitch, -sin_pitch], [0.0, sin_pitch, cos_pitch]])
    roll = np.array([[cos_roll, sin_roll, 0.0], [-sin_roll, cos_roll, 0.0], [0.0, 0.0, 1.0]])
    return roll @ pitch @ forward


def level_gravity(*, pitch_down: float, roll_cw: float) -> _Array:
    """Return the unit vector down in the optical frame of a camera on a level body; radians."""
    return optical_from_body(pitch_down=pitch_down, roll_cw=roll_cw) @ (0.0, 0.0, -1.0)


def down_of(rotation: _Array) -> _Array:
    """Return the unit vector down in a frame; rotation (3, 3) is from it to one with z up."""
    return -rotation[2]


def rotation_from(quaternion: Sequence[float]) -> _Array:
    """
    Return the (3, 3) rotation that a quaternion x, y, z, w stands for.

    In sensor_msgs/Imu it is from the body's frame to one whose z is up (REP 103, REP 145).

    :raises DepthPersonError: when the quaternion is not finite or not of unit length.
    """
    x, y, z, w = quaternion
    length = math.sqrt(x * x + y * y + z * z + w * w)
    if not abs(length - 1) <= _UNIT:  # NaN fails, too
        raise DepthPersonError(
            f'an orientation has a quaternion of length {length:g} instead of 1; check that the '
            'autopilot publishes its attitude, not only raw rates')
    x, y, z, w = (part / length for part in (x, y, z, w))
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])


def turned(one: _Array, other: _Array, share: float) -> _Array:
    """Return the rotation at a share of the way from one (3, 3) to another, about one axis."""
    vector, _ = cv2.Rodrigues(one.T @ other)
    step, _ = cv2.Rodrigues(share * vector)
    return one @ step
