"""Bytes to and from an autopilot: UDP or a serial line, in the notation of pymavlink."""
from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from importlib import import_module
import select
import socket
from typing import Any, Protocol

from depth_person.errors import DepthPersonError

#: More than any MAVLink packet, and all of a UDP datagram that holds several.
_DATAGRAM = 65535
_BAUD_RATE = 115_200
#: A serial line that takes no bytes for so long is no use, seconds.
_WRITE_TIMEOUT_S = 0.2
_FORMS = 'udpout:HOST:PORT, udpin:HOST:PORT or /dev/NAME[,BAUD]'


class Transport(Protocol):
    """A way to an autopilot; methods raise OSError when it is broken."""

    def wait(self, timeout_s: float) -> bool:
        """Return whether there is something to receive, waiting for it at most so long."""
        ...

    def receive(self) -> bytes:
        """Return what has come; nothing when nothing has."""
        ...

    def accept(self) -> None:
        """Answer from now on to where the last bytes came from."""
        ...

    def send(self, packet: bytes) -> None:
        """Send one packet; without effect while nobody is known to send it to."""
        ...

    def close(self) -> None:
        """Let go of it."""
        ...


@dataclass(frozen=True)
class Connection:
    """Where an autopilot is; made by parse_connection."""

    kind: str
    address: str
    number: int

    def open(self) -> Transport:
        """
        Open it.

        :raises OSError: when that is not possible now.
        :raises DepthPersonError: when a serial line is asked for without pyserial.
        """
        if self.kind == 'serial':
            return _Serial(self.address, self.number)
        return _Udp(self.address, self.number, listen=self.kind == 'udpin')


def parse_connection(text: str) -> Connection:
    """
    Return what a connection string means.

    :param text: `udpout:HOST:PORT` sends there, `udpin:HOST:PORT` (or `udp:`) waits for the
        autopilot, `/dev/NAME` or `/dev/NAME,BAUD` is a serial line.
    :raises DepthPersonError: when it is none of them.
    """
    if text.startswith('/dev/'):
        device, _, baud = text.partition(',')
        if baud and not (baud.isascii() and baud.isdigit()):
            raise DepthPersonError(f'connection {text!r}: {baud!r} is not a baud rate')
        return Connection('serial', device, int(baud or _BAUD_RATE))
    kind, _, rest = text.partition(':')
    host, _, port = rest.rpartition(':')
    if kind not in ('udp', 'udpin', 'udpout') or not host or not (
            port.isascii() and port.isdigit() and 0 < int(port) < 65536):
        raise DepthPersonError(f'connection {text!r} is not of the form {_FORMS}')
    return Connection('udpin' if kind == 'udp' else kind, host, int(port))


class _Udp:
    """A UDP socket; one that listens answers to where an autopilot has been heard."""

    def __init__(self, host: str, port: int, *, listen: bool) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._to: Any = None
        self._from: Any = None
        self._listens = listen
        try:
            self._socket.setblocking(False)
            if listen:
                self._socket.bind((host, port))
            else:
                self._to = socket.getaddrinfo(host, port, socket.AF_INET)[0][4]
        except OSError:
            self._socket.close()
            raise

    def wait(self, timeout_s: float) -> bool:
        return bool(select.select([self._socket], [], [], timeout_s)[0])

    def receive(self) -> bytes:
        try:
            data, self._from = self._socket.recvfrom(_DATAGRAM)
        except (BlockingIOError, ConnectionRefusedError):  # nobody listens there, perhaps yet
            return b''
        return data

    def accept(self) -> None:
        if self._listens:
            self._to = self._from

    def send(self, packet: bytes) -> None:
        if self._to is None:
            return
        with suppress(BlockingIOError, ConnectionRefusedError):  # the next datagram replaces it
            self._socket.sendto(packet, self._to)

    def close(self) -> None:
        self._socket.close()


class _Serial:
    """A serial line."""

    def __init__(self, device: str, baud_rate: int) -> None:
        try:
            serial = import_module('serial')
        except ImportError as error:
            raise DepthPersonError(
                f'the serial line {device} needs pyserial ({error}); install it: pip install '
                "'depth_person[mavlink]'") from error
        try:
            self._port = serial.Serial(
                device, baud_rate, timeout=0, write_timeout=_WRITE_TIMEOUT_S, exclusive=True)
        except (ValueError, OverflowError) as error:
            raise OSError(f'{device} takes no {baud_rate} baud: {error}') from error

    def wait(self, timeout_s: float) -> bool:
        return bool(select.select([self._port.fileno()], [], [], timeout_s)[0])

    def receive(self) -> bytes:
        data: bytes = self._port.read(_DATAGRAM)
        return data

    def accept(self) -> None:
        """Do nothing: a line has one other end."""

    def send(self, packet: bytes) -> None:
        self._port.write(packet)

    def close(self) -> None:
        self._port.close()
