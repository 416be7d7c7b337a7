"""How the camera sits on the vehicle, and the vehicle's level frame."""
from __future__ import annotations

from dataclasses import dataclass
import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from depth_person.distance.attitude import optical_from_body
from depth_person.distance.vectors import cross

_Array = NDArray[np.float64]

_DOWN = (0.0, 0.0, -1.0)
_FORWARD = np.array([1.0, 0.0, 0.0])
#: A nose closer to the vertical than this (sine of 10 degrees) has no bearing.
_STEEPEST = 0.17


@dataclass(frozen=True, eq=False)
class CameraOnBody:
    """
    Where a camera is on a vehicle, whose x is forward, y left and z up (base_link, REP 103).

    :ivar rotation: (3, 3) from the camera optical frame to the vehicle's.
    :ivar position: (3,) of the camera in the vehicle's frame, metres.
    """

    rotation: _Array
    position: _Array

    @classmethod
    def mounted(
        cls, *, pitch_down: float = 0.0, roll_cw: float = 0.0, yaw_right: float = 0.0,
        position: ArrayLike = (0.0, 0.0, 0.0),
    ) -> CameraOnBody:
        """
        Return a camera that looks forward, turned right, then pitched down, then rolled.

        :param roll_cw: clockwise, as seen from behind; all angles in radians.
        :param position: metres.
        """
        sin_yaw, cos_yaw = math.sin(yaw_right), math.cos(yaw_right)
        turn = np.array([[cos_yaw, -sin_yaw, 0.0], [sin_yaw, cos_yaw, 0.0], [0.0, 0.0, 1.0]])
        rotation = (optical_from_body(pitch_down=pitch_down, roll_cw=roll_cw) @ turn).T
        return cls(rotation, np.asarray(position, np.float64))

    def to_body(self, points: _Array) -> _Array:
        """Return points (..., 3) of the camera optical frame in the vehicle's, metres."""
        return points @ self.rotation.T + self.position


@dataclass(frozen=True, eq=False)
class LevelView:
    """
    A camera in the vehicle's level frame: x ahead, y to the right, z down.

    The origin is the vehicle's, x is its forward direction laid flat, z is along gravity.

    :ivar rotation: (3, 3) from the camera optical frame.
    :ivar position: (3,) of the camera, metres.
    """

    rotation: _Array
    position: _Array

    @classmethod
    def of(cls, camera: CameraOnBody, gravity: _Array | None) -> LevelView | None:
        """
        Return how a camera sits in the level frame; None while the nose points up or down.

        :param gravity: unit vector of the direction down in the camera optical frame; None takes
            the vehicle for level.
        """
        down = np.array(_DOWN) if gravity is None else camera.rotation @ gravity
        ahead = _FORWARD - down[0] * down
        length = np.linalg.norm(ahead)
        if not length > _STEEPEST:
            return None
        ahead = ahead / length
        level_from_body = np.array([ahead, cross(down, ahead), down])
        return cls(level_from_body @ camera.rotation, level_from_body @ camera.position)

    def to_level(self, points: _Array) -> _Array:
        """Return points (..., 3) of the camera optical frame in the level frame, metres."""
        return points @ self.rotation.T + self.position

    def to_optical(self, directions: _Array) -> _Array:
        """Return directions (..., 3) of the level frame in the camera optical frame."""
        return directions @ self.rotation
