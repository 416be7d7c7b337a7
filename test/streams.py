"""Streams on this machine for tests and benchmarks: a sender, a lossy relay, an RTSP server."""
from __future__ import annotations

from base64 import b64encode
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
import random
import re
import socket
import subprocess
import threading
import time

from depth_person.camera.pattern import draw_pattern

ENCODERS = {
    'h264': ('-c:v', 'libx264', '-preset', 'ultrafast', '-tune', 'zerolatency',
             '-pix_fmt', 'yuv420p'),
    'mpeg4': ('-c:v', 'mpeg4', '-q:v', '3'),
}


def free_port(kind=socket.SOCK_DGRAM):
    """Return an even port that is free, and so is the next: RTP has its control there."""
    while True:
        port = random.randrange(20000, 30000, 2)
        with suppress(OSError), socket.socket(socket.AF_INET, kind) as one, \
                socket.socket(socket.AF_INET, kind) as other:
            one.bind(('127.0.0.1', port))
            other.bind(('127.0.0.1', port + 1))
            return port


class Sender:
    """
    Encodes the test pattern with FFmpeg, one frame at a time, as a camera does.

    :param ffmpeg: the program.
    :param output: FFmpeg's words for format and address.
    :ivar sent_ns: when each frame was drawn, by number, time.time_ns.
    """

    def __init__(self, ffmpeg, *output, size=(320, 240), fps=25, codec='h264', first=0):
        self.sent_ns: dict[int, int] = {}
        self._size, self._fps, self._first = size, fps, first
        self._process = subprocess.Popen(
            [ffmpeg, '-v', 'error', '-f', 'rawvideo', '-pix_fmt', 'bgr24',
             '-s', f'{size[0]}x{size[1]}', '-use_wallclock_as_timestamps', '1',
             '-i', '-', '-fps_mode', 'passthrough', *ENCODERS[codec], '-g', str(fps),
             *map(str, output)],
            stdin=subprocess.PIPE, stderr=subprocess.DEVNULL)
        self._thread = threading.Thread(target=self._feed, daemon=True)
        self._thread.start()

    def stop(self):
        """Stop sending at once, as a camera that is unplugged."""
        self._process.kill()
        self._process.wait()
        self._thread.join()

    def _feed(self):
        start_s = time.monotonic()
        number = 0
        while self._process.poll() is None:
            image = draw_pattern(self._first + number, self._size)
            self.sent_ns[self._first + number] = time.time_ns()
            try:
                self._process.stdin.write(image)
                self._process.stdin.flush()
            except OSError:  # FFmpeg has ended
                return
            number += 1
            time.sleep(max(start_s + number / self._fps - time.monotonic(), 0))


class Relay:
    """
    Hands on the datagrams that come to a port, and loses some of them.

    :param deliver: takes each datagram.
    :param loss: the part of them that is lost, the same ones each time.
    """

    def __init__(self, deliver: Callable[[bytes], None], *, port=0, loss=0.0):
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4_000_000)
        self._socket.bind(('127.0.0.1', port))
        self._socket.settimeout(0.2)
        self.port = self._socket.getsockname()[1]
        self.handed_on = self.lost = 0
        self._deliver = deliver
        self._loss = loss
        self._closed = False
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def close(self):
        self._closed = True
        self._thread.join()
        self._socket.close()

    def _run(self):
        chance = random.Random(1)
        while not self._closed:
            with suppress(TimeoutError):
                datagram = self._socket.recv(65536)
                if chance.random() < self._loss:
                    self.lost += 1
                else:
                    self.handed_on += 1
                    self._deliver(datagram)


class RtspServer:
    """
    Serves one RTP stream under rtsp://127.0.0.1:PORT/live over TCP and UDP.

    :param ffmpeg: the program whose Sender feeds it.
    :param folder: for the description of the stream.
    :param credentials: user and password that clients have to give.
    :param loss: the part of the RTP datagrams that is lost on the way to clients.
    """

    def __init__(self, ffmpeg, folder, *, port, credentials=None, loss=0.0, **sender):
        self._relays = self._relay_pair(loss)
        self._clients: list[_RtspClient] = []
        self._wanted = None
        if credentials is not None:
            self._wanted = 'Basic ' + b64encode(':'.join(credentials).encode()).decode()
        description = Path(folder) / f'{port}.sdp'
        description.unlink(missing_ok=True)
        self.sender = Sender(
            ffmpeg, '-f', 'rtp', '-sdp_file', description,
            f'rtp://127.0.0.1:{self._relays[0].port}?pkt_size=1200', **sender)
        while not (description.exists() and 'm=video' in description.read_text()):
            time.sleep(0.02)
        self._sdp = re.sub(r'm=video \d+', 'm=video 0', description.read_text().partition('v=')[2])
        self._sdp = 'v=' + self._sdp.rstrip() + '\r\na=control:video\r\n'
        self._socket = socket.create_server(('127.0.0.1', port))
        self._thread = threading.Thread(target=self._accept, daemon=True)
        self._thread.start()

    def stop(self):
        """Go away at once."""
        self._socket.shutdown(socket.SHUT_RDWR)
        self._socket.close()
        self._thread.join()
        self.sender.stop()
        for relay in self._relays:
            relay.close()
        for client in self._clients:
            client.close()

    def answer(self, method, headers):
        """Return status line, headers and body of the answer to a request."""
        if self._wanted not in (None, headers.get('authorization')):
            return '401 Unauthorized', ['WWW-Authenticate: Basic realm="test"'], ''
        if method == 'DESCRIBE':
            return '200 OK', ['Content-Type: application/sdp'], self._sdp
        if method == 'SETUP':
            return '200 OK', [f'Transport: {headers["transport"]}', 'Session: 1'], ''
        return '200 OK', ['Session: 1', 'Public: DESCRIBE, SETUP, PLAY, TEARDOWN'], ''

    def _relay_pair(self, loss):
        port = free_port()
        return [Relay(lambda data: self._send(0, data), port=port, loss=loss),
                Relay(lambda data: self._send(1, data), port=port + 1)]

    def _send(self, channel, datagram):
        for client in self._clients:
            client.send(channel, datagram)

    def _accept(self):
        with suppress(OSError):  # until the socket is shut
            while True:
                connection, _ = self._socket.accept()
                self._clients.append(_RtspClient(self, connection))


class _RtspClient:
    """One connection to the server."""

    def __init__(self, server, connection):
        self._server = server
        self._connection = connection
        self._lock = threading.Lock()
        self._udp_ports: list[int] = []
        self._udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._playing = False
        threading.Thread(target=self._serve, daemon=True).start()

    def close(self):
        self._playing = False
        with suppress(OSError):
            self._connection.shutdown(socket.SHUT_RDWR)

    def send(self, channel, datagram):
        if not self._playing:
            return
        try:
            if self._udp_ports:
                self._udp.sendto(datagram, ('127.0.0.1', self._udp_ports[channel]))
            else:
                frame = b'$' + bytes([channel]) + len(datagram).to_bytes(2, 'big') + datagram
                with self._lock:
                    self._connection.sendall(frame)
        except OSError:
            self._playing = False

    def _serve(self):
        with suppress(OSError), self._connection.makefile('rb') as stream:
            while line := stream.readline():
                if line[:1] == b'$':  # the client's own RTCP
                    stream.read(int.from_bytes(line[2:4], 'big') - len(line) + 4)
                elif line.strip():
                    self._reply(line.decode().split()[0], self._headers(stream))

    def _headers(self, stream):
        headers = {}
        while line := stream.readline().decode().strip():
            name, _, value = line.partition(':')
            headers[name.lower()] = value.strip()
        return headers

    def _reply(self, method, headers):
        if method == 'SETUP':
            ports = re.search(r'client_port=(\d+)-(\d+)', headers['transport'])
            self._udp_ports = list(map(int, ports.groups())) if ports else []
        status, lines, body = self._server.answer(method, headers)
        head = [f'RTSP/1.0 {status}', f'CSeq: {headers["cseq"]}', *lines,
                f'Content-Length: {len(body)}', '', body]
        with self._lock:
            self._connection.sendall('\r\n'.join(head).encode())
        if method == 'PLAY':
            self._playing = True
        if method == 'TEARDOWN':
            self.close()
