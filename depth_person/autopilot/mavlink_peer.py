"""What an autopilot tells over MAVLink: that it is there, what time it is, and where it is."""
from __future__ import annotations

from collections import deque
from dataclasses import dataclass
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depth_person.autopilot.geodesy import ned_from_body, Place

_Array = NDArray[np.float64]

#: An autopilot whose heartbeat (1 Hz) has not been heard for longer is gone, nanoseconds.
GONE_NS = 3_000_000_000
#: A position or an attitude that is further from an image than this says nothing of it.
FRESH_NS = 500_000_000
#: Answers to time requests that are compared, and attitudes that are kept.
_ANSWERS, _ATTITUDES = 10, 100
#: Two answers that differ by more are of two clocks: the autopilot, or this machine's clock, has
#: started again.
_JUMP_NS = 1_000_000_000
_AUTOPILOT = 1  # component id
_POLE = 900_000_000  # degrees times 1e7


class PeerClock:
    """
    Finds when an autopilot was started, by this machine's clock, from TIMESYNC.

    Of the last answers the one that came back fastest counts: an answer errs by at most half of
    its round trip.
    """

    def __init__(self) -> None:
        self._asked_ns = 0
        self._answers: deque[tuple[int, int]] = deque(maxlen=_ANSWERS)

    @property
    def boot_ns(self) -> int | None:
        """The autopilot's start by this machine's clock; None while it has not answered."""
        return min(self._answers)[1] if self._answers else None

    @property
    def round_trip_s(self) -> float | None:
        """How long the fastest of the last answers took."""
        return min(self._answers)[0] * 1e-9 if self._answers else None

    def ask(self, now_ns: int) -> int:
        """Return the ts1 of a request that is sent now."""
        self._asked_ns = now_ns
        return now_ns

    def take_answer(self, *, tc1: int, ts1: int, now_ns: int) -> None:
        """Take an answer; one to somebody else's question is passed over."""
        if ts1 != self._asked_ns or now_ns < ts1:
            return
        boot_ns = (ts1 + now_ns) // 2 - tc1
        if self.boot_ns is not None and abs(boot_ns - self.boot_ns) > _JUMP_NS:
            self._answers.clear()
        self._answers.append((now_ns - ts1, boot_ns))


@dataclass(frozen=True, eq=False)
class _Attitude:
    stamp_ns: int
    ned_from_body: _Array


@dataclass(frozen=True)
class _Position:
    stamp_ns: int
    place: Place
    velocity: tuple[float, float, float]  # north, east, down, metres a second


class Peer:
    """
    Keeps the latest of what one autopilot says; what it keeps is bounded.

    Times are nanoseconds of this machine's clock, the one that stamps images.

    :param system_id: of the vehicle; what other systems say is passed over.
    """

    def __init__(self, system_id: int) -> None:
        self.clock = PeerClock()
        self._system_id = system_id
        self._heard_ns: int | None = None
        self._attitudes: deque[_Attitude] = deque(maxlen=_ATTITUDES)
        self._position: _Position | None = None

    def silent_s(self, now_ns: int) -> float | None:
        """Return how long ago its heartbeat was heard; None if never."""
        return None if self._heard_ns is None else (now_ns - self._heard_ns) * 1e-9

    def alive(self, now_ns: int) -> bool:
        """Whether its heartbeat has been heard lately."""
        return self._heard_ns is not None and 0 <= now_ns - self._heard_ns <= GONE_NS

    def is_from(self, message: Any) -> bool:
        """Whether a message comes from this vehicle's autopilot."""
        return (message.get_srcSystem() == self._system_id
                and message.get_srcComponent() == _AUTOPILOT)

    def take(self, message: Any, now_ns: int) -> None:
        """Take a decoded message that has come from it now."""
        kind = message.get_type()
        if kind == 'HEARTBEAT':
            self._heard_ns = now_ns
        elif kind == 'TIMESYNC' and message.tc1 != 0:
            self.clock.take_answer(tc1=message.tc1, ts1=message.ts1, now_ns=now_ns)
        elif kind == 'ATTITUDE' and all(
                map(math.isfinite, (message.roll, message.pitch, message.yaw))):
            rotation = ned_from_body(roll=message.roll, pitch=message.pitch, yaw=message.yaw)
            self._attitudes.append(
                _Attitude(self._stamp_ns(message.time_boot_ms, now_ns), rotation))
        elif (kind == 'GLOBAL_POSITION_INT' and abs(message.lat) <= _POLE
                and (message.lat or message.lon)):  # 0, 0 is no fix
            self._position = _Position(
                self._stamp_ns(message.time_boot_ms, now_ns),
                Place(message.lat * 1e-7, message.lon * 1e-7, message.alt * 1e-3),
                (message.vx * 1e-2, message.vy * 1e-2, message.vz * 1e-2))

    def boot_ms(self, stamp_ns: int, *, else_boot_ns: int) -> int:
        """
        Return a time in milliseconds since the autopilot's start, never negative.

        :param else_boot_ns: taken for its start until it has told the time.
        """
        boot_ns = self.clock.boot_ns
        return max(stamp_ns - (else_boot_ns if boot_ns is None else boot_ns), 0) // 1_000_000

    def place_of(self, position: _Array, stamp_ns: int) -> tuple[Place, _Array] | None:
        """
        Return where something seen from the vehicle is, and the rotation to north, east, down.

        :param position: (3,) forward, right, down of the vehicle, metres.
        :param stamp_ns: when it was seen there.
        :returns: None when place or attitude of the vehicle at that time is not known.
        """
        attitude = min(
            tuple(self._attitudes), default=None,
            key=lambda each: abs(each.stamp_ns - stamp_ns))
        own = self._position
        if attitude is None or own is None:
            return None
        if max(abs(each.stamp_ns - stamp_ns) for each in (attitude, own)) > FRESH_NS:
            return None
        flown = np.array(own.velocity) * (stamp_ns - own.stamp_ns) * 1e-9
        north, east, down = (attitude.ned_from_body @ position + flown).tolist()
        return own.place.moved(north, east, down), attitude.ned_from_body

    def _stamp_ns(self, boot_ms: int, now_ns: int) -> int:
        boot_ns = self.clock.boot_ns
        return now_ns if boot_ns is None else boot_ns + boot_ms * 1_000_000
