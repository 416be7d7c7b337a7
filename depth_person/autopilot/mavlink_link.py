"""The traffic with one autopilot: heartbeats, time, what it says, and what it is told."""
from __future__ import annotations

from collections.abc import Callable, Iterable
import threading
import time
from typing import Any

from depth_person.autopilot.mavlink_messages import Companion, open_dialect
from depth_person.autopilot.mavlink_peer import Peer
from depth_person.autopilot.mavlink_transport import Connection, Transport

#: Heartbeats and time requests, and attempts to open a broken connection, so often, seconds.
_PERIOD_S = 1.0
_POLL_S = 0.05
#: Bytes that are looked at in a second: twice what a fast serial line carries.
_BUDGET = 200_000
#: Datagrams that are taken before anything else gets its turn.
_ROUND = 64


class MavlinkLink:
    """
    Keeps a connection to an autopilot open, from one thread, which calls `run`.

    What comes in is bounded in memory and in work: a peer that floods is heard in part.

    :ivar received: messages that came from the autopilot so far.
    :ivar foreign: messages that came from anybody else.
    :ivar damaged: pieces that are no messages.
    :ivar dropped: bytes of a flood that were not looked at.
    :param now_ns: the clock that stamps images.
    """

    def __init__(
        self, connection: Connection, companion: Companion, peer: Peer, *,
        now_ns: Callable[[], int],
    ) -> None:
        self.received = self.foreign = self.damaged = self.dropped = 0
        self._connection = connection
        self._companion = companion
        self._peer = peer
        self._now_ns = now_ns
        self._transport: Transport | None = None
        self._problem = 'the connection is not open yet'
        self._broken: OSError | None = None
        self._sending = threading.Lock()
        self._spent = 0
        self._flooded_s = float('-inf')

    @property
    def problem(self) -> str:
        """Why nothing can be sent; empty when something can."""
        return '' if self._transport is not None else self._problem

    @property
    def flooded(self) -> bool:
        """Whether more has come in the last seconds than is looked at."""
        return time.monotonic() - self._flooded_s < 2 * _PERIOD_S

    def send(self, packets: Iterable[bytes]) -> bool:
        """Send packets, from any thread; return whether that was possible."""
        with self._sending:
            if self._transport is None or self._broken is not None:
                return False
            try:
                for packet in packets:
                    self._transport.send(packet)
            except OSError as error:
                self._broken = error
                return False
        return True

    def run(self, stopping: threading.Event) -> None:
        """Exchange messages until told to stop; open the connection again when it breaks."""
        parser = open_dialect().MAVLink(None)
        parser.robust_parsing = True
        due_s = time.monotonic()
        try:
            while not stopping.is_set():
                if time.monotonic() >= due_s:
                    due_s = time.monotonic() + _PERIOD_S
                    self._each_second()
                transport = self._transport
                if transport is None:
                    stopping.wait(_POLL_S)
                    continue
                try:
                    self._receive(transport, parser)
                except OSError as error:
                    self._broken = error
                if self._broken is not None:
                    self._close(str(self._broken))
        finally:
            self._close('the connection is closed')

    def _each_second(self) -> None:
        self._spent = 0
        if self._transport is None:
            try:
                self._transport = self._connection.open()
            except OSError as error:
                self._problem = str(error)
                return
        self.send([
            self._companion.heartbeat(),
            self._companion.timesync(tc1=0, ts1=self._peer.clock.ask(self._now_ns()))])

    def _receive(self, transport: Transport, parser: Any) -> None:
        if not transport.wait(_POLL_S):
            return
        for _ in range(_ROUND):
            data = transport.receive()
            if not data:
                return
            self._spent += len(data)
            if self._spent > _BUDGET:
                self.dropped += len(data)
                self._flooded_s = time.monotonic()
                continue
            now_ns = self._now_ns()
            for message in parser.parse_buffer(data) or ():
                self._take(message, now_ns, transport)

    def _take(self, message: Any, now_ns: int, transport: Transport) -> None:
        kind = message.get_type()
        if kind == 'BAD_DATA':
            self.damaged += 1
        elif not self._peer.is_from(message):
            self.foreign += 1
        else:
            self.received += 1
            transport.accept()
            self._peer.take(message, now_ns)
            if kind == 'TIMESYNC' and message.tc1 == 0:
                self.send([self._companion.timesync(
                    tc1=now_ns, ts1=message.ts1)])

    def _close(self, problem: str) -> None:
        with self._sending:
            if self._transport is not None:
                self._transport.close()
            self._transport, self._broken = None, None
            self._problem = problem
