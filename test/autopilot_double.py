"""An autopilot at the other end of a UDP connection, spoken to with pymavlink."""
from __future__ import annotations

import socket
import time

from pymavlink.dialects.v20 import ardupilotmega as dialect

VEHICLE = 1


class AutopilotDouble:
    """Answers time requests when asked to, and keeps what it hears."""

    def __init__(self, *, system_id=VEHICLE):
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(('127.0.0.1', 0))
        self._socket.settimeout(0.02)
        self.port = self._socket.getsockname()[1]
        self._mav = dialect.MAVLink(None, srcSystem=system_id, srcComponent=1)
        self._parser = dialect.MAVLink(None)
        self.peer = None
        self.heard = []
        #: When the autopilot was started, nanoseconds of time.time_ns.
        self.boot_ns = time.time_ns() - 5_000_000_000

    def listen(self):
        """Take what has come, and answer time requests."""
        try:
            data, self.peer = self._socket.recvfrom(65535)
        except TimeoutError:
            return
        for message in self._parser.parse_buffer(data) or []:
            self.heard.append(message)
            if message.get_type() == 'TIMESYNC' and message.tc1 == 0:
                self.send(dialect.MAVLink_timesync_message(
                    time.time_ns() - self.boot_ns, message.ts1))

    def drain(self):
        """Forget what has been heard, also what waits to be."""
        before = -1
        while len(self.heard) > before:
            before = len(self.heard)
            self.listen()
        self.heard.clear()

    def listen_until(self, done, timeout_s=60.0):
        deadline = time.monotonic() + timeout_s
        while not done():
            assert time.monotonic() < deadline, [str(message) for message in self.heard]
            self.listen()

    def of(self, kind):
        """Return the messages of a type that have been heard."""
        return [message for message in self.heard if message.get_type() == kind]

    def send(self, message):
        """Send a message to where the last one came from."""
        self.send_bytes(message.pack(self._mav))
        self._mav.seq = (self._mav.seq + 1) % 256

    def send_bytes(self, data):
        self._socket.sendto(bytes(data), self.peer)

    def heartbeat(self):
        self.send(dialect.MAVLink_heartbeat_message(
            dialect.MAV_TYPE_QUADROTOR, dialect.MAV_AUTOPILOT_ARDUPILOTMEGA, 0, 0, 4, 3))

    def boot_ms(self):
        return (time.time_ns() - self.boot_ns) // 1_000_000

    def stand_at(self, latitude, longitude, altitude, *, heading_deg):
        """Say where the vehicle is, level and still."""
        self.send(dialect.MAVLink_attitude_message(
            self.boot_ms(), 0.0, 0.0, heading_deg * 3.141592653589793 / 180, 0, 0, 0))
        self.send(dialect.MAVLink_global_position_int_message(
            self.boot_ms(), round(latitude * 1e7), round(longitude * 1e7),
            round(altitude * 1e3), 0, 0, 0, 0, round(heading_deg * 100)))

    def close(self):
        self._socket.close()
