"""Where something that is seen from a vehicle is on the Earth."""
from __future__ import annotations

from dataclasses import dataclass
import math

import numpy as np
from numpy.typing import NDArray

_Array = NDArray[np.float64]

#: WGS84: the equatorial radius, metres, and the square of the eccentricity.
_RADIUS = 6_378_137.0
_ECCENTRICITY_2 = 6.694379990141e-3


@dataclass(frozen=True)
class Place:
    """A place on the Earth (WGS84): degrees, and metres above mean sea level."""

    latitude: float
    longitude: float
    altitude: float

    def moved(self, north: float, east: float, down: float) -> Place:
        """Return the place so many metres away, for distances up to some kilometres."""
        sine = math.sin(math.radians(self.latitude))
        bulge = 1 - _ECCENTRICITY_2 * sine * sine
        meridian = _RADIUS * (1 - _ECCENTRICITY_2) / bulge ** 1.5
        parallel = _RADIUS / math.sqrt(bulge) * math.cos(math.radians(self.latitude))
        longitude = self.longitude + math.degrees(east / parallel)
        return Place(
            self.latitude + math.degrees(north / meridian), (longitude + 180) % 360 - 180,
            self.altitude - down)


def ned_from_body(*, roll: float, pitch: float, yaw: float) -> _Array:
    """
    Return the (3, 3) rotation from a vehicle's forward, right, down to north, east, down.

    :param roll: to the right, after pitch, radians; the order is that of MAVLink's ATTITUDE.
    :param pitch: nose up, after yaw, radians.
    :param yaw: clockwise from north, radians.
    """
    sin_roll, cos_roll = math.sin(roll), math.cos(roll)
    sin_pitch, cos_pitch = math.sin(pitch), math.cos(pitch)
    sin_yaw, cos_yaw = math.sin(yaw), math.cos(yaw)
    about_x = np.array([[1, 0, 0], [0, cos_roll, -sin_roll], [0, sin_roll, cos_roll]])
    about_y = np.array([[cos_pitch, 0, sin_pitch], [0, 1, 0], [-sin_pitch, 0, cos_pitch]])
    about_z = np.array([[cos_yaw, -sin_yaw, 0], [sin_yaw, cos_yaw, 0], [0, 0, 1]])
    return about_z @ about_y @ about_x
