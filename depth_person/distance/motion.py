"""How people may move, and the camera's frame with them."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depth_person.distance.vectors import polar, UNIT_MATRIX

_Array = NDArray[np.float64]


@dataclass(frozen=True)
class Motion:
    """
    What is not known of how people move in the frame that they are followed in.

    :ivar speed: spread of a velocity of which nothing is known, metres a second.
    :ivar acceleration: by how much velocities change: the square root of the intensity of a white
        acceleration, m/s^2 by the root of a second.
    :ivar turn_rate: spread of the frame's own turning about the camera, radians a second.
    :ivar turn_acceleration: by how much that changes, rad/s^2 by the root of a second.
    """

    speed: float
    acceleration: float
    turn_rate: float = 0.0
    turn_acceleration: float = 0.0

    def velocities(self, away: _Array) -> _Array:
        """Return covariances (n, 3, 3) of the velocities of people at (n, 3) from the camera."""
        return _covariances(away, self.speed, self.turn_rate)

    def accelerations(self, away: _Array) -> _Array:
        """Return the intensities (n, 3, 3) of their accelerations."""
        return _covariances(away, self.acceleration, self.turn_acceleration)


def _covariances(away: _Array, each_way: float, turning: float) -> _Array:
    """Return (n, 3, 3) of spreads each_way, and across the ray turning by metres as well."""
    distance, ray = polar(away)
    wider = (turning * distance) ** 2
    across = UNIT_MATRIX - ray[:, :, None] * ray[:, None]
    return each_way ** 2 * UNIT_MATRIX + wider[:, None, None] * across
