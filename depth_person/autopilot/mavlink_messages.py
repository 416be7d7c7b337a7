"""People as MAVLink messages; needs pymavlink (extra `mavlink`), which is imported on demand."""
from __future__ import annotations

from collections.abc import Iterable
from importlib import import_module
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depth_person.autopilot.geodesy import Place
from depth_person.autopilot.scan import BINS
from depth_person.errors import DepthPersonError

#: What OBSTACLE_DISTANCE says of a bin of which nothing is known.
UNKNOWN = 65535
#: Only the position of a target is told (bit 0 of est_capabilities).
_POSITION_ONLY = 1


def open_dialect() -> Any:
    """
    Return pymavlink's MAVLink 2 dialect with ArduPilot's additions.

    :raises DepthPersonError: when pymavlink is not installed.
    """
    try:
        return import_module('pymavlink.dialects.v20.ardupilotmega')
    except ImportError as error:
        raise DepthPersonError(
            f'MAVLink needs pymavlink ({error}); install it: pip install '
            "'depth_person[mavlink]'") from error


class Companion:
    """
    Encodes what a companion computer tells an autopilot, each message with its sequence number.

    :param system_id: of the vehicle, of which the companion is a part.
    :param component_id: of the companion on it.
    :param follow_system_id: that the person to follow has: autopilots follow another system.
    :raises DepthPersonError: when pymavlink is not installed.
    """

    def __init__(self, *, system_id: int, component_id: int, follow_system_id: int) -> None:
        self._dialect = open_dialect()
        self._own = self._dialect.MAVLink(
            None, srcSystem=system_id, srcComponent=component_id)
        self._followed = self._dialect.MAVLink(
            None, srcSystem=follow_system_id, srcComponent=self._dialect.MAV_COMP_ID_AUTOPILOT1)

    def heartbeat(self) -> bytes:
        """Return the sign of life of an onboard controller."""
        dialect = self._dialect
        return _packed(self._own, dialect.MAVLink_heartbeat_message(
            dialect.MAV_TYPE_ONBOARD_CONTROLLER, dialect.MAV_AUTOPILOT_INVALID, 0, 0,
            dialect.MAV_STATE_ACTIVE, 3))

    def timesync(self, *, tc1: int, ts1: int) -> bytes:
        """Return a question (tc1 0) or an answer of the time synchronisation, nanoseconds."""
        return _packed(self._own, self._dialect.MAVLink_timesync_message(tc1, ts1))

    def obstacle_distance(
        self, ranges: NDArray[np.float32], *, stamp_ns: int, range_min: float, range_max: float,
    ) -> bytes:
        """
        Return OBSTACLE_DISTANCE, whose bins begin ahead and go clockwise.

        :param ranges: (72,) metres; NaN where nothing is known.
        """
        dialect = self._dialect
        with np.errstate(invalid='ignore'):
            centimetres = np.floor(np.asarray(ranges, np.float64) * 100)
        told = np.where(
            (centimetres >= 0) & (centimetres < UNKNOWN), centimetres, UNKNOWN).astype(int)
        step = 360 // BINS
        return _packed(self._own, dialect.MAVLink_obstacle_distance_message(
            time_usec=stamp_ns // 1000, sensor_type=dialect.MAV_DISTANCE_SENSOR_UNKNOWN,
            distances=told.tolist(), increment=step, min_distance=_limit(range_min),
            max_distance=_limit(range_max), increment_f=float(step), angle_offset=0.0,
            frame=dialect.MAV_FRAME_BODY_FRD))

    def obstacles_3d(
        self, people: Iterable[tuple[int, NDArray[np.float64]]], *, boot_ms: int,
        range_min: float, range_max: float,
    ) -> list[bytes]:
        """
        Return one OBSTACLE_DISTANCE_3D a person, all of one stamp, by which they are one set.

        :param people: track ids and positions forward, right, down of the vehicle, metres.
        """
        dialect = self._dialect
        return [
            _packed(self._own, dialect.MAVLink_obstacle_distance_3d_message(
                time_boot_ms=boot_ms & 0xFFFFFFFF,
                sensor_type=dialect.MAV_DISTANCE_SENSOR_UNKNOWN,
                frame=dialect.MAV_FRAME_BODY_FRD, obstacle_id=track_id % UNKNOWN,
                x=float(position[0]), y=float(position[1]), z=float(position[2]),
                min_distance=range_min, max_distance=range_max))
            for track_id, position in people]

    def follow_target(
        self, place: Place, *, boot_ms: int, sigma_horizontal: float, sigma_vertical: float,
    ) -> bytes:
        """Return FOLLOW_TARGET: where the person to follow is, as a system of their own."""
        nothing = [0.0, 0.0, 0.0]
        return _packed(self._followed, self._dialect.MAVLink_follow_target_message(
            timestamp=boot_ms, est_capabilities=_POSITION_ONLY, lat=round(place.latitude * 1e7),
            lon=round(place.longitude * 1e7), alt=place.altitude, vel=nothing, acc=nothing,
            attitude_q=[1.0, 0.0, 0.0, 0.0], rates=nothing,
            position_cov=[sigma_horizontal, sigma_vertical, 0.0], custom_state=0))


def _limit(metres: float) -> int:
    """Return a limit of a scan in centimetres, of whatever a publisher says it is."""
    return math.floor(min(max(0.0, metres * 100), UNKNOWN - 1))


def _packed(sender: Any, message: Any) -> bytes:
    """Return a message's bytes, and count it."""
    packet = bytes(message.pack(sender))
    sender.seq = (sender.seq + 1) % 256
    return packet
