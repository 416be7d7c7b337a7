"""Streams of the test pattern on this machine, for tests and benchmarks."""
from __future__ import annotations

from pathlib import Path
import re
import socket
import time

from rtsp_server import RtspServer
from senders import free_port, Relay, Sender

#: How the stream of a Sender may reach us; see open_stream.
STREAMS = ('rtsp-tcp', 'rtsp-udp', 'mpegts-udp', 'rtp-sdp')


class Stream:
    """
    A stream of the test pattern on this machine, a context manager.

    :param kind: one of STREAMS.
    :param folder: for descriptions of streams.
    :param loss: the part of the datagrams that is lost on their way.
    :ivar source: what a camera_node is given for it.
    :ivar rtsp_transport: the same.
    """

    def __init__(self, kind, ffmpeg, folder, *, loss=0.0, **sender):
        self._ffmpeg, self._kind, self._folder = ffmpeg, kind, Path(folder)
        self._loss, self._options = loss, sender
        self._port = free_port(
            socket.SOCK_STREAM if kind.startswith('rtsp') else socket.SOCK_DGRAM)
        self._description = self._folder / f'{self._port}.sdp'
        self.rtsp_transport = 'udp' if kind == 'rtsp-udp' else 'tcp'
        self.source = {'rtsp': f'rtsp://127.0.0.1:{self._port}/live',
                       'mpegts': f'udp://127.0.0.1:{self._port}',
                       'rtp': str(self._description)}[kind.partition('-')[0]]
        self._parts = []

    def __enter__(self):
        self.start()
        return self

    def __exit__(self, *_):
        self.stop()

    def start(self):
        """Begin to send; frames are numbered from 0."""
        if self._kind.startswith('rtsp'):
            server = RtspServer(self._ffmpeg, self._folder, port=self._port, loss=self._loss,
                                **self._options)
            self.sender, self._parts = server.sender, [server.stop]
            return
        self._description.unlink(missing_ok=True)
        out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        relay = Relay(lambda data: out.sendto(data, ('127.0.0.1', self._port)), loss=self._loss)
        output = (['-f', 'mpegts', f'udp://127.0.0.1:{relay.port}?pkt_size=1316']
                  if self._kind == 'mpegts-udp' else
                  ['-f', 'rtp', '-sdp_file', self._description,
                   f'rtp://127.0.0.1:{relay.port}?pkt_size=1200'])
        self.sender = Sender(self._ffmpeg, *output, **self._options)
        self._parts = [self.sender.stop, relay.close, out.close]
        if self._kind == 'rtp-sdp':
            self._describe()

    def stop(self):
        """Stop at once."""
        for part in self._parts:
            part()
        self._parts = []

    def _describe(self):
        """Wait for the description, and put the port in that the relay sends to."""
        while 'a=fmtp' not in (text := self._description.read_text()
                               if self._description.exists() else ''):
            time.sleep(0.02)
        self._description.write_text(re.sub(
            r'm=video \d+', f'm=video {self._port}', 'v=' + text.partition('v=')[2]))
