"""What sends video on this machine for tests and benchmarks: a camera, and a lossy relay."""
from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
import random
import socket
import subprocess
import threading
import time

from depth_person.camera.pattern import draw_pattern

#: How many frames' times of drawing are kept.
_REMEMBERED = 2000
#: Neither DDS takes these ports, in domains up to 100, nor Linux for outgoing connections.
_PORTS = range(61_000, 65_000, 2)
ENCODERS = {
    'h264': ('-c:v', 'libx264', '-preset', 'ultrafast', '-tune', 'zerolatency',
             '-pix_fmt', 'yuv420p'),
    'mpeg4': ('-c:v', 'mpeg4', '-q:v', '3'),
}


def free_port(kind=socket.SOCK_DGRAM):
    """Return an even port that is free, and so is the next: RTP has its control there."""
    while True:
        port = random.choice(_PORTS)
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
    :ivar sent_ns: when each of the last frames was drawn, by number, time.time_ns.
    """

    def __init__(self, ffmpeg, *output, size=(320, 240), fps=25, codec='h264', first=0):
        self.sent_ns: dict[int, int] = {}
        self._size, self._fps, self._first = size, fps, first
        self._process = subprocess.Popen(
            [ffmpeg, '-v', 'error', '-f', 'rawvideo', '-pix_fmt', 'bgr24',
             '-s', f'{size[0]}x{size[1]}', '-framerate', '1000',
             '-use_wallclock_as_timestamps', '1', '-i', '-', '-fps_mode', 'passthrough',
             *ENCODERS[codec], '-g', str(fps), *map(str, output)],
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
            self.sent_ns.pop(self._first + number - _REMEMBERED, None)
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
