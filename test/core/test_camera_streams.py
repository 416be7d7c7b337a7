"""Streams from servers on this machine: transports, passwords, refusals, and coming back."""
import os
import socket
import threading
import time

import cv2
import imageio_ffmpeg
import pytest
from rtsp_server import RtspServer
from senders import free_port, Sender
from streams import Stream, STREAMS

from depth_person.camera import opencv, stream_fault
from depth_person.camera.opencv import open_capture
from depth_person.camera.pattern import read_number
from depth_person.camera.source import SourceLost, SourceUnusable
from depth_person.camera.sources import open_source
from depth_person.errors import DepthPersonError

FFMPEG = imageio_ffmpeg.get_ffmpeg_exe()
PASSWORD = 'hunter:2@x'
QUOTED = 'hunter%3A2%40x'


@pytest.fixture(scope='module')
def guarded(tmp_path_factory):
    """Return the port of an RTSP server that wants user and password."""
    port = free_port(socket.SOCK_STREAM)
    server = RtspServer(FFMPEG, tmp_path_factory.mktemp('guarded'), port=port,
                        credentials=('me', PASSWORD))
    yield port
    server.stop()


@pytest.mark.parametrize('kind', STREAMS)
def test_every_kind_of_stream_is_read_newest_first_with_its_senders_times(kind, tmp_path):
    with Stream(kind, FFMPEG, tmp_path) as stream, open_source(
            stream.source, rtsp_transport=stream.rtsp_transport) as source:
        frames = [source.read() for _ in range(25)]
        time.sleep(0.5)
        source.read()
        late_ns = time.time_ns() - stream.sender.sent_ns[read_number(source.read().image)]
        drawn_ns = [stream.sender.sent_ns[read_number(frame.image)] for frame in frames]

    assert late_ns < 0.4e9
    assert frames[0].image.shape == (240, 320, 3)
    errors_ns = [frame.stamp_ns - drawn for frame, drawn in zip(frames, drawn_ns, strict=True)]
    assert 0 < sorted(errors_ns)[12] < 0.4e9
    assert [frame.stamp_ns for frame in frames] == sorted(frame.stamp_ns for frame in frames)


def test_a_quoted_password_opens_the_stream_and_is_seen_nowhere(guarded, capfd):
    url = f'rtsp://me:{QUOTED}@127.0.0.1:{guarded}/live'
    with open_source(url) as source:
        source.read()
        said = source.description
    assert said == f'stream rtsp://me:***@127.0.0.1:{guarded}/live'
    assert capfd.readouterr() == ('', '')


@pytest.mark.parametrize(('user', 'said'), [
    ('me:wrong@', 'does not take this user and password'),
    ('', 'wants a user and password; write ://USER:PASSWORD@ in the URL'),
])
def test_wrong_credentials_are_told_from_other_faults(guarded, user, said, capfd):
    with pytest.raises(SourceUnusable, match=said) as caught:
        open_source(f'rtsp://{user}127.0.0.1:{guarded}/live')
    assert 'wrong' not in str(caught.value)
    assert capfd.readouterr() == ('', '')


def answering(answer):
    """Return the port of a server that gives every client one answer."""
    server = socket.create_server(('127.0.0.1', 0))

    def serve():
        while True:
            connection, _ = server.accept()
            connection.recv(4096)
            connection.sendall(answer)
            connection.close()

    threading.Thread(target=serve, daemon=True).start()
    return server.getsockname()[1]


@pytest.mark.parametrize(('url', 'answer', 'said'), [
    ('rtsp://127.0.0.1:{}/live', None, '127.0.0.1 refuses connections on port'),
    ('rtsp://127.0.0.1:{}/live', b'RTSP/1.0 404 Not Found\r\nCSeq: 1\r\n\r\n',
     r'no such stream \(404\)'),
    ('http://127.0.0.1:{}/live', b'HTTP/1.0 503 Busy\r\n\r\n', 'answers with status 503'),
    ('http://127.0.0.1:{}/live', b'HTTP/1.0 200 OK\r\n\r\nhello', 'no video that can be read'),
    ('http://127.0.0.1:{}/live', b'hello', 'does not answer on port'),
])
def test_a_refusal_is_explained_and_may_pass(url, answer, said):
    port = free_port(socket.SOCK_STREAM) if answer is None else answering(answer)
    with pytest.raises(DepthPersonError, match=said) as caught:
        open_source(url.format(port))
    assert not isinstance(caught.value, SourceUnusable)


@pytest.mark.parametrize(('url', 'kind', 'said'), [
    ('rtsp://me:p:w@ss@nowhere:x/live', SourceUnusable, 'write @, : and / in a password as %40'),
    ('rtsp:///live', SourceUnusable, 'it names no host'),
    ('udp://127.0.0.1:5000', DepthPersonError, 'nobody sends there yet'),
])
def test_what_can_be_told_from_the_url_alone_is_told(url, kind, said):
    fault = stream_fault.stream_fault(url)
    assert type(fault) is kind
    assert said in str(fault)


def test_an_unknown_host_is_named_without_the_password(monkeypatch):
    def unknown(address, timeout_s):
        raise socket.gaierror(-2, 'Name or service not known')

    monkeypatch.setattr(socket, 'create_connection', unknown)
    fault = stream_fault.stream_fault('rtsp://me:hunter2@camera.local/live')
    assert str(fault) == (
        'stream rtsp://me:***@camera.local/live cannot be opened: there is no host camera.local; '
        'check the name, and the network')


def test_a_sender_that_comes_back_with_another_size_is_opened_anew():
    port = free_port()
    output = ('-f', 'mpegts', f'udp://127.0.0.1:{port}?pkt_size=1316')
    sender = Sender(FFMPEG, *output)
    with open_source(f'udp://127.0.0.1:{port}', timeout_s=5.0) as source:
        source.read()
        sender.stop()
        sender = Sender(FFMPEG, *output, size=(480, 128))
        with pytest.raises(SourceLost, match='its sender has started anew'):
            list(iter(source.read, None))
    with open_source(f'udp://127.0.0.1:{port}') as source:
        assert source.read().image.shape == (128, 480, 3)
    sender.stop()


def test_the_users_own_options_come_on_top_and_stay(monkeypatch):
    seen = []
    monkeypatch.setattr(cv2, 'VideoCapture', lambda *_: seen.append(
        os.environ['OPENCV_FFMPEG_CAPTURE_OPTIONS']))
    monkeypatch.setenv('OPENCV_FFMPEG_CAPTURE_OPTIONS', 'rtsp_transport;udp')

    open_capture('rtsp://host/live', cv2.CAP_FFMPEG, ffmpeg_options='rtsp_transport;tcp|a;b')

    assert seen == ['rtsp_transport;tcp|a;b|rtsp_transport;udp']  # the last one counts
    assert os.environ['OPENCV_FFMPEG_CAPTURE_OPTIONS'] == 'rtsp_transport;udp'


def test_options_are_gone_once_a_stream_is_open(monkeypatch):
    monkeypatch.delenv('OPENCV_FFMPEG_CAPTURE_OPTIONS', raising=False)
    open_capture('/nowhere', cv2.CAP_FFMPEG, ffmpeg_options='a;b')
    assert 'OPENCV_FFMPEG_CAPTURE_OPTIONS' not in os.environ


def test_an_opening_that_hangs_does_not_hang_the_next_for_ever(monkeypatch):
    monkeypatch.setattr(opencv, '_LOCK_TIMEOUT_S', 0.1)
    with opencv._lock, pytest.raises(DepthPersonError, match='still hangs'):
        open_capture('/nowhere', cv2.CAP_FFMPEG)


def test_a_pipeline_without_gstreamer_is_refused_with_a_way_out(monkeypatch):
    monkeypatch.setattr(cv2.videoio_registry, 'getBackends', lambda: [cv2.CAP_FFMPEG])
    with pytest.raises(SourceUnusable, match=r'built without GStreamer.*python3-opencv'):
        open_source('videotestsrc ! videoconvert ! appsink')


def test_a_pipeline_that_does_not_start_is_named_without_its_password(monkeypatch):
    monkeypatch.setattr(cv2.videoio_registry, 'getBackends', lambda: [cv2.CAP_GSTREAMER])
    with pytest.raises(DepthPersonError, match='does not start; try it with gst-launch') as caught:
        open_source('rtspsrc location=rtsp://127.0.0.1/ user-id=me user-pw=hunter2 ! appsink')
    assert 'hunter2' not in str(caught.value)
