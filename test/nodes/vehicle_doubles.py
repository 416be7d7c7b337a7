"""
Stand-ins for what receives the scan: MAVROS's conversion, ArduPilot's and PX4's obstacle maps.

Written from their documented behaviour: the MAVLink message definitions, MAVROS's plugin
documentation, and the manuals of ArduPilot (proximity, simple avoidance) and PX4 (collision
prevention). Distances in centimetres, times in seconds.
"""
from __future__ import annotations

from dataclasses import dataclass
import math

import numpy as np

UNKNOWN = 65535


@dataclass(frozen=True)
class ObstacleDistance:
    """The fields of MAVLink's OBSTACLE_DISTANCE that receivers look at."""

    distances: tuple[int, ...]
    increment_deg: float
    angle_offset_deg: float
    min_distance: int
    max_distance: int
    frame: str


def uint16(value):
    """Cast as C does: cut off what is behind the point; what does not fit is a mistake."""
    assert 0 <= value < 65536, f'{value} does not survive the cast'
    return int(value)


def mavros_converts(scan, *, mav_frame='BODY_FRD'):
    """Return what MAVROS's obstacle_distance plugin sends for a LaserScan of up to 72 bins."""
    assert len(scan.ranges) <= 72
    distances = []
    for metres in np.asarray(scan.ranges, np.float32):
        centimetres = np.float32(np.float64(metres) * 100)
        unknown = np.isnan(centimetres) or centimetres >= UNKNOWN or centimetres < 0
        distances.append(UNKNOWN if unknown else uint16(centimetres))
    distances += [UNKNOWN] * (72 - len(distances))
    return ObstacleDistance(
        tuple(distances), float(np.float32(math.degrees(scan.angle_increment))),
        math.degrees(scan.angle_min), uint16(np.float32(scan.range_min) * 100.0),
        uint16(np.float32(scan.range_max) * 100.0), mav_frame)


class ArduPilotProximity:
    """
    ArduPilot's proximity boundary, fed by MAVLink (PRX1_TYPE 2), middle layer.

    Eight sectors of 45 degrees, sector 0 around ahead, clockwise. What is out of the sensor's
    limits is passed over. A sector forgets after a second; the sensor is unhealthy after half a
    second of silence.
    """

    SECTORS, HEALTHY_S, KEPT_S = 8, 0.5, 1.0

    def __init__(self):
        self._heard_s = None
        self._sectors = {}

    def take(self, message, now_s):
        """Take one OBSTACLE_DISTANCE."""
        self._heard_s = now_s
        nearest = {}
        for index, centimetres in enumerate(message.distances):
            if centimetres in (0, UNKNOWN):
                continue
            if not message.min_distance <= centimetres <= message.max_distance:
                continue
            bearing = index * message.increment_deg + message.angle_offset_deg
            sector = int(((bearing + 22.5) % 360) // 45)
            nearest[sector] = min(centimetres / 100, nearest.get(sector, math.inf))
        for sector, metres in nearest.items():
            self._sectors[sector] = (metres, now_s)

    def healthy(self, now_s):
        """Whether the sensor counts as present."""
        return self._heard_s is not None and now_s - self._heard_s <= self.HEALTHY_S

    def sectors(self, now_s):
        """Return sector -> metres for what is known."""
        return {
            sector: metres for sector, (metres, heard_s) in self._sectors.items()
            if now_s - heard_s <= self.KEPT_S}


class Px4CollisionPrevention:
    """
    PX4's map for collision prevention in position mode.

    Bins of 10 degrees round ahead, clockwise, each read from one bin of the message. Unknown bins
    leave the map alone; what is older than half a second is unknown. Without any data nothing
    moves.

    :param go_no_data: CP_GO_NO_DATA: directions may be flown in that have never had data.
    """

    BINS, STEP_DEG, KEPT_S = 36, 10, 0.5

    def __init__(self, *, go_no_data=False):
        self._go_no_data = go_no_data
        self._bins = {}
        self._ever = set()

    def take(self, message, now_s):
        """Take one OBSTACLE_DISTANCE."""
        assert message.frame == 'BODY_FRD', 'another frame would be taken for north-aligned'
        for own in range(self.BINS):
            bearing = np.float32((own * self.STEP_DEG - message.angle_offset_deg) % 360)
            index = math.ceil(bearing * (np.float32(1) / np.float32(message.increment_deg)))
            centimetres = message.distances[index]
            if centimetres != UNKNOWN:
                self._bins[own] = (centimetres, message.max_distance, now_s)
                self._ever.add(own)

    def obstacles(self, now_s):
        """Return bin -> metres of obstacles; free bins are left out."""
        return {own: centimetres / 100 for own, (centimetres, limit, heard_s) in
                self._bins.items() if now_s - heard_s <= self.KEPT_S and centimetres <= limit}

    def may_fly(self, bearing_deg, now_s, *, keep_m=2.0):
        """Whether a step in a direction is allowed."""
        fresh = {own: value for own, value in self._bins.items()
                 if now_s - value[2] <= self.KEPT_S}
        if not fresh:
            return False
        own = int((bearing_deg % 360) // self.STEP_DEG)
        if own not in fresh:
            return self._go_no_data and own not in self._ever
        return fresh[own][0] / 100 > keep_m
