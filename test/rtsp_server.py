"""An RTSP server for tests and benchmarks."""
from __future__ import annotations

from base64 import b64encode
from contextlib import suppress
from pathlib import Path
import re
import socket
import threading
import time

from senders import free_port, Relay, Sender


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
